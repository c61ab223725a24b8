#include "scenarios/input_tables.hpp"

#include "scenarios/field_binding.hpp"
#include "scenarios/format_limits.hpp"
#include "scenarios/shape_tables.hpp"

namespace soda::scenarios {
namespace {

constexpr std::string_view kStepKeys[] = {"step"};
constexpr std::string_view kTimeKeys[] = {"time_s"};
constexpr Alternatives kTimes{kStepKeys, kTimeKeys};

template <class T, std::size_t N>
constexpr std::array<Field, 3 + N> input_fields(const std::array<Field, N>& others) {
  std::array<Field, 3 + N> all{
      field<T, &T::id>("id", kRequired, kId,
                       "Identity, unique among the inputs; orders those of one step."),
      field<T, &T::step>("step", kOptional, Limits{0.0, 1e9},
                         "Step at whose beginning it acts; or give time_s."),
      field<T, &T::time_s>("time_s", kOptional, Limits{0.0, 1e9},
                           "When it acts: a whole number of steps, within a relative 1e-9."),
  };
  for (std::size_t i = 0; i < N; ++i) all[3 + i] = others[i];
  return all;
}

template <class T, std::size_t N>
constexpr std::array<Field, 4 + N> body_input_fields(const std::array<Field, N>& others) {
  std::array<Field, 1 + N> own{
      field<T, &T::body>("body", kRequired, kId, "Id of a body of the scene.")};
  for (std::size_t i = 0; i < N; ++i) own[1 + i] = others[i];
  return input_fields<T>(own);
}

constexpr auto kAddFields = body_input_fields<AddSpec>(std::array{
    field<AddSpec, &AddSpec::position_m>("position_m", kOptional, kPosition,
                                         "Its centre of mass; by default as the body is declared."),
    choice_field<AddSpec, &AddSpec::orientation>("orientation", kOptional, kNone, kOrientation,
                                                 "By default as the body is declared."),
    field<AddSpec, &AddSpec::velocity_m_s>("velocity_m_s", kOptional, kSpeed,
                                           "By default as the body is declared."),
    field<AddSpec, &AddSpec::angular_velocity_rad_s>("angular_velocity_rad_s", kOptional, kSpeed,
                                                     "By default as the body is declared."),
});
constexpr auto kRemoveFields = body_input_fields<RemoveSpec>(std::array<Field, 0>{});
constexpr auto kPushFields = body_input_fields<PushSpec>(std::array{
    field<PushSpec, &PushSpec::impulse_newton_s>("impulse_newton_s", kRequired, Limits{-1e12, 1e12},
                                                 "Impulse, world frame."),
    field<PushSpec, &PushSpec::point_m>(
        "point_m", kOptional, Limits{-kMaxLength_m, kMaxLength_m},
        "Where it acts: from the centre of mass, in the frame of the body."),
});
constexpr auto kSetVelocityFields = body_input_fields<SetVelocitySpec>(std::array{
    field<SetVelocitySpec, &SetVelocitySpec::velocity_m_s>(
        "velocity_m_s", kOptional, kSpeed, "The new one; stays as it is by default."),
    field<SetVelocitySpec, &SetVelocitySpec::angular_velocity_rad_s>(
        "angular_velocity_rad_s", kOptional, kSpeed, "The new one; stays as it is by default."),
});
constexpr auto kChangeMaterialFields = body_input_fields<ChangeMaterialSpec>(std::array{
    field<ChangeMaterialSpec, &ChangeMaterialSpec::friction>("friction", kRequired,
                                                             Limits{0.0, 100.0}, "The new one."),
    field<ChangeMaterialSpec, &ChangeMaterialSpec::restitution>("restitution", kRequired,
                                                                kUnitInterval, "The new one."),
    field<ChangeMaterialSpec, &ChangeMaterialSpec::rolling_friction_m>(
        "rolling_friction_m", kOptional, Limits{0.0, 1e5}, "The new one."),
    field<ChangeMaterialSpec, &ChangeMaterialSpec::torsional_friction_m>(
        "torsional_friction_m", kOptional, Limits{0.0, 1e5}, "The new one."),
});

constexpr Limits kMotorSpeed{-1e6, 1e6}, kMotorPush{0.0, 1e15};
constexpr auto kSetMotorFields = input_fields<SetMotorSpec>(std::array{
    field<SetMotorSpec, &SetMotorSpec::joint>(
        "joint", kRequired, kId,
        "Id of a hinge or slider that has a motor. What is not given here stays."),
    field<SetMotorSpec, &SetMotorSpec::motor_speed_rad_s>("motor_speed_rad_s", kOptional,
                                                          kMotorSpeed, "The new one, of a hinge."),
    field<SetMotorSpec, &SetMotorSpec::motor_torque_newton_m>(
        "motor_torque_newton_m", kOptional, kMotorPush, "The new one, of a hinge."),
    field<SetMotorSpec, &SetMotorSpec::motor_target_rad>("motor_target_rad", kOptional,
                                                         Limits{-kMostTurn_rad, kMostTurn_rad},
                                                         "The new one, of a hinge."),
    field<SetMotorSpec, &SetMotorSpec::motor_speed_m_s>("motor_speed_m_s", kOptional, kMotorSpeed,
                                                        "The new one, of a slider."),
    field<SetMotorSpec, &SetMotorSpec::motor_force_newton>("motor_force_newton", kOptional,
                                                           kMotorPush, "The new one, of a slider."),
    field<SetMotorSpec, &SetMotorSpec::motor_target_m>("motor_target_m", kOptional,
                                                       Limits{-kMaxLength_m, kMaxLength_m},
                                                       "The new one, of a slider."),
});

struct InputTables {
  ObjectTable add, remove, push, set_velocity, change_material, set_motor;
};

constexpr InputTables tables(const Alternatives* times) {
  return {object_table<AddSpec>("add", "Lets a body take part that does not.", kAddFields, times),
          object_table<RemoveSpec>("remove", "Takes a body out; it may be added again.",
                                   kRemoveFields, times),
          object_table<PushSpec>("push", "Gives a body an impulse.", kPushFields, times),
          object_table<SetVelocitySpec>("set-velocity", "Gives a body a velocity, or a spin.",
                                        kSetVelocityFields, times),
          object_table<ChangeMaterialSpec>("change-material", "Gives a body another surface.",
                                           kChangeMaterialFields, times),
          object_table<SetMotorSpec>("set-motor", "Gives the motor of a joint another task.",
                                     kSetMotorFields, times)};
}

constexpr InputTables kTimed = tables(&kTimes);
constexpr InputTables kUntimed = tables(nullptr);

constexpr std::array<ChoiceEntry, 6> entries(const InputTables& of) {
  return {choice_entry<InputSpec, AddSpec>("add", of.add),
          choice_entry<InputSpec, RemoveSpec>("remove", of.remove),
          choice_entry<InputSpec, PushSpec>("push", of.push),
          choice_entry<InputSpec, SetVelocitySpec>("set-velocity", of.set_velocity),
          choice_entry<InputSpec, ChangeMaterialSpec>("change-material", of.change_material),
          choice_entry<InputSpec, SetMotorSpec>("set-motor", of.set_motor)};
}

constexpr auto kTimedEntries = entries(kTimed);
constexpr auto kUntimedEntries = entries(kUntimed);

constexpr ChoiceTable input_choice(std::span<const ChoiceEntry> of) {
  return {.name = "input",
          .doc = "Something that a user does to a body or a joint at the beginning of a step.",
          .tag = "type",
          .entries = of,
          .elsewhere = {},
          .elsewhere_hint = {}};
}

}  // namespace

constexpr ChoiceTable kInput = input_choice(kTimedEntries);
constexpr ChoiceTable kInputLine = input_choice(kUntimedEntries);

}  // namespace soda::scenarios
