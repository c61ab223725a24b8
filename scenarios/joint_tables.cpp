#include "scenarios/joint_tables.hpp"

#include "scenarios/field_binding.hpp"
#include "scenarios/format_limits.hpp"

namespace soda::scenarios {
namespace {

constexpr Limits kBreaking{1e-12, 1e15};

template <class T, std::size_t N>
constexpr std::array<Field, 7 + N> joint_fields(const std::array<Field, N>& others) {
  std::array<Field, 7 + N> all{
      field<T, &T::id>("id", kRequired, kId, "Identity, unique among the joints."),
      field<T, &T::body>("body", kRequired, kId, "Id of a body that is there from the start."),
      field<T, &T::other_body>("other_body", kOptional, kId,
                               "Id of another one; without it, the world."),
      field<T, &T::anchor_m>("anchor_m", kRequired, kPosition,
                             "Where it holds the body at the start, world frame."),
      field<T, &T::can_collide>("can_collide", kOptional, kNone,
                                "Whether its two bodies can touch."),
      field<T, &T::reach_m>("reach_m", kOptional, kLength,
                            "How far from its anchor each body looks for the other's; a joint that "
                            "is pulled farther apart is a numerical failure. By default a quarter "
                            "of the smaller body's size, four times that for sliders, and the "
                            "length and four times that for distances and springs; of a slider "
                            "with two limits the farther one, and twice the size. At least as far "
                            "as a motor drives a slider in the run, and as the heavier body, with "
                            "the greatest speed and force of both at the start, stretches a "
                            "spring in it."),
      field<T, &T::break_force_newton>(
          "break_force_newton", kOptional, kBreaking,
          "It breaks, for ever, at the end of a step over which it pulled or pushed by more on the "
          "mean; without it, never. Limits and motors count."),
  };
  for (std::size_t i = 0; i < N; ++i) all[7 + i] = others[i];
  return all;
}

template <class T>
constexpr Field axis_field() {
  return field<T, &T::axis>("axis", kRequired, Limits{-1e6, 1e6},
                            "Its axis at the start, world frame; of any length.");
}

template <class T>
constexpr Field break_torque_field() {
  return field<T, &T::break_torque_newton_m>(
      "break_torque_newton_m", kOptional, kBreaking,
      "Of what turns or bends it, as break_force_newton of forces; about its anchor, of a slider "
      "that in the world or the body with the higher id.");
}

template <class T>
constexpr Field time_constant_field() {
  return field<T, &T::motor_time_constant_s>(
      "motor_time_constant_s", kOptional, Limits{1e-4, 1e6},
      "With a target: the time in which what is left falls to 1/e, as far as speed and push allow; "
      "0.1 s by default.");
}

template <class T>
constexpr std::array<Field, 2> distance_fields() {
  return {field<T, &T::other_anchor_m>("other_anchor_m", kRequired, kPosition,
                                       "Where it holds the other body, or the world, at the start, "
                                       "world frame."),
          field<T, &T::length_m>("length_m", kOptional, Limits{0.0, kMaxLength_m},
                                 "Between the anchors, at rest; by default what it is at the "
                                 "start.")};
}

constexpr auto kBallFields = joint_fields<BallSpec>(std::array<Field, 0>{});
constexpr auto kHingeFields = joint_fields<HingeSpec>(std::array{
    axis_field<HingeSpec>(), break_torque_field<HingeSpec>(),
    field<HingeSpec, &HingeSpec::min_angle_rad>(
        "min_angle_rad", kOptional, Limits{-kMostTurn_rad, 0.0},
        "How far the body can be turned back about the axis, against the other one."),
    field<HingeSpec, &HingeSpec::max_angle_rad>(
        "max_angle_rad", kOptional, Limits{0.0, kMostTurn_rad},
        "How far it can be turned on. Stops do not bounce."),
    field<HingeSpec, &HingeSpec::motor_speed_rad_s>(
        "motor_speed_rad_s", kOptional, Limits{-1e6, 1e6},
        "Speed to which a motor turns the body about the axis, against the other one."),
    field<HingeSpec, &HingeSpec::motor_torque_newton_m>(
        "motor_torque_newton_m", kOptional, Limits{0.0, 1e15}, "The most that the motor can do."),
    field<HingeSpec, &HingeSpec::motor_target_rad>(
        "motor_target_rad", kOptional, Limits{-kMostTurn_rad, kMostTurn_rad},
        "Angle to which the motor turns the body from the start, and holds it there (a servo), at "
        "no more than its speed."),
    time_constant_field<HingeSpec>()});
constexpr auto kSliderFields = joint_fields<SliderSpec>(std::array{
    axis_field<SliderSpec>(), break_torque_field<SliderSpec>(),
    field<SliderSpec, &SliderSpec::min_way_m>(
        "min_way_m", kOptional, Limits{-kMaxLength_m, 0.0},
        "How far the body can be moved back along the axis, against the other one."),
    field<SliderSpec, &SliderSpec::max_way_m>("max_way_m", kOptional, Limits{0.0, kMaxLength_m},
                                              "How far it can be moved on. Stops do not bounce."),
    field<SliderSpec, &SliderSpec::motor_speed_m_s>(
        "motor_speed_m_s", kOptional, Limits{-1e6, 1e6},
        "Speed to which a motor moves the body along the axis, against the other one."),
    field<SliderSpec, &SliderSpec::motor_force_newton>(
        "motor_force_newton", kOptional, Limits{0.0, 1e15}, "The most that the motor can do."),
    field<SliderSpec, &SliderSpec::motor_target_m>(
        "motor_target_m", kOptional, Limits{-kMaxLength_m, kMaxLength_m},
        "Way along the axis to which the motor moves the body from the start, and holds it there "
        "(a servo), at no more than its speed."),
    time_constant_field<SliderSpec>()});
constexpr auto kFixedFields = joint_fields<FixedSpec>(std::array{break_torque_field<FixedSpec>()});
constexpr auto kDistanceFields = joint_fields<DistanceSpec>(distance_fields<DistanceSpec>());
constexpr auto kSpringOwn = distance_fields<SpringSpec>();
constexpr auto kSpringFields = joint_fields<SpringSpec>(
    std::array{kSpringOwn[0], kSpringOwn[1],
               field<SpringSpec, &SpringSpec::stiffness_newton_m>(
                   "stiffness_newton_m", kRequired, Limits{1e-12, 1e15}, "Force over stretch."),
               field<SpringSpec, &SpringSpec::damping_newton_s_m>(
                   "damping_newton_s_m", kOptional, Limits{0.0, 1e15}, "Force over speed.")});

constexpr ObjectTable kBall =
    object_table<BallSpec>("ball", "Two points stay in one place.", kBallFields);
constexpr ObjectTable kHinge =
    object_table<HingeSpec>("hinge", "A ball joint that turns about one axis.", kHingeFields);
constexpr ObjectTable kSlider = object_table<SliderSpec>(
    "slider", "The bodies move along one axis, without turning.", kSliderFields);
constexpr ObjectTable kFixed =
    object_table<FixedSpec>("fixed", "The bodies are as one.", kFixedFields);
constexpr ObjectTable kDistance =
    object_table<DistanceSpec>("distance", "Two points keep their distance.", kDistanceFields);
constexpr ObjectTable kSpring = object_table<SpringSpec>(
    "spring", "A linear spring and damper between two points.", kSpringFields);

constexpr ChoiceEntry kEntries[] = {choice_entry<JointSpec, BallSpec>("ball", kBall),
                                    choice_entry<JointSpec, HingeSpec>("hinge", kHinge),
                                    choice_entry<JointSpec, SliderSpec>("slider", kSlider),
                                    choice_entry<JointSpec, FixedSpec>("fixed", kFixed),
                                    choice_entry<JointSpec, DistanceSpec>("distance", kDistance),
                                    choice_entry<JointSpec, SpringSpec>("spring", kSpring)};

}  // namespace

constexpr ChoiceTable kJoint{.name = "joint",
                             .doc = "What holds two bodies together, or a body to the world.",
                             .tag = "type",
                             .entries = kEntries,
                             .elsewhere = {},
                             .elsewhere_hint = {}};

}  // namespace soda::scenarios
