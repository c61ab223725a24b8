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
constexpr std::array<Field, 4 + N> input_fields(const std::array<Field, N>& others) {
  std::array<Field, 4 + N> all{
      field<T, &T::id>("id", kRequired, kId,
                       "Identity, unique among the inputs; orders those of one step."),
      field<T, &T::step>("step", kOptional, Limits{0.0, 1e9},
                         "Step at whose beginning it acts; or give time_s."),
      field<T, &T::time_s>("time_s", kOptional, Limits{0.0, 1e9},
                           "When it acts: a whole number of steps, within a relative 1e-9."),
      field<T, &T::body>("body", kRequired, kId, "Id of a body of the scene."),
  };
  for (std::size_t i = 0; i < N; ++i) all[4 + i] = others[i];
  return all;
}

constexpr auto kAddFields = input_fields<AddSpec>(std::array{
    field<AddSpec, &AddSpec::position_m>("position_m", kOptional, kPosition,
                                         "Its centre of mass; by default as the body is declared."),
    choice_field<AddSpec, &AddSpec::orientation>("orientation", kOptional, kNone, kOrientation,
                                                 "By default as the body is declared."),
    field<AddSpec, &AddSpec::velocity_m_s>("velocity_m_s", kOptional, kSpeed,
                                           "By default as the body is declared."),
    field<AddSpec, &AddSpec::angular_velocity_rad_s>("angular_velocity_rad_s", kOptional, kSpeed,
                                                     "By default as the body is declared."),
});
constexpr auto kRemoveFields = input_fields<RemoveSpec>(std::array<Field, 0>{});
constexpr auto kPushFields = input_fields<PushSpec>(std::array{
    field<PushSpec, &PushSpec::impulse_newton_s>("impulse_newton_s", kRequired, Limits{-1e12, 1e12},
                                                 "Impulse, world frame."),
    field<PushSpec, &PushSpec::point_m>(
        "point_m", kOptional, Limits{-kMaxLength_m, kMaxLength_m},
        "Where it acts: from the centre of mass, in the frame of the body."),
});
constexpr auto kSetVelocityFields = input_fields<SetVelocitySpec>(std::array{
    field<SetVelocitySpec, &SetVelocitySpec::velocity_m_s>(
        "velocity_m_s", kOptional, kSpeed, "The new one; stays as it is by default."),
    field<SetVelocitySpec, &SetVelocitySpec::angular_velocity_rad_s>(
        "angular_velocity_rad_s", kOptional, kSpeed, "The new one; stays as it is by default."),
});
constexpr auto kChangeMaterialFields = input_fields<ChangeMaterialSpec>(std::array{
    field<ChangeMaterialSpec, &ChangeMaterialSpec::friction>("friction", kRequired,
                                                             Limits{0.0, 100.0}, "The new one."),
    field<ChangeMaterialSpec, &ChangeMaterialSpec::restitution>("restitution", kRequired,
                                                                kUnitInterval, "The new one."),
});

struct InputTables {
  ObjectTable add, remove, push, set_velocity, change_material;
};

constexpr InputTables tables(const Alternatives* times) {
  return {object_table<AddSpec>("add", "Lets a body take part that does not.", kAddFields, times),
          object_table<RemoveSpec>("remove", "Takes a body out; it may be added again.",
                                   kRemoveFields, times),
          object_table<PushSpec>("push", "Gives a body an impulse.", kPushFields, times),
          object_table<SetVelocitySpec>("set-velocity", "Gives a body a velocity, or a spin.",
                                        kSetVelocityFields, times),
          object_table<ChangeMaterialSpec>("change-material", "Gives a body another surface.",
                                           kChangeMaterialFields, times)};
}

constexpr InputTables kTimed = tables(&kTimes);
constexpr InputTables kUntimed = tables(nullptr);

constexpr std::array<ChoiceEntry, 5> entries(const InputTables& of) {
  return {choice_entry<InputSpec, AddSpec>("add", of.add),
          choice_entry<InputSpec, RemoveSpec>("remove", of.remove),
          choice_entry<InputSpec, PushSpec>("push", of.push),
          choice_entry<InputSpec, SetVelocitySpec>("set-velocity", of.set_velocity),
          choice_entry<InputSpec, ChangeMaterialSpec>("change-material", of.change_material)};
}

constexpr auto kTimedEntries = entries(kTimed);
constexpr auto kUntimedEntries = entries(kUntimed);

constexpr ChoiceTable input_choice(std::span<const ChoiceEntry> of) {
  return {.name = "input",
          .doc = "Something that a user does to a body at the beginning of a step.",
          .tag = "type",
          .entries = of,
          .elsewhere = {},
          .elsewhere_hint = {}};
}

}  // namespace

constexpr ChoiceTable kInput = input_choice(kTimedEntries);
constexpr ChoiceTable kInputLine = input_choice(kUntimedEntries);

}  // namespace soda::scenarios
