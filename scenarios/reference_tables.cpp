#include "scenarios/reference_tables.hpp"

#include "scenarios/bound_tables.hpp"
#include "scenarios/joint_reference_tables.hpp"
#include "scenarios/shape_tables.hpp"

namespace soda::scenarios {
namespace {

template <class Spec>
constexpr Field friction_field() {
  return field<Spec, &Spec::friction>("friction", kRequired, Limits{0.0, 100.0},
                                      "Coulomb coefficient of the pair.");
}
template <class Spec>
constexpr Field restitution_field() {
  return field<Spec, &Spec::restitution>("restitution", kRequired, kUnitInterval, "Of the pair.");
}
template <class Spec>
constexpr std::array<Field, 4> slope_fields() {
  return {body_field<Spec>(),
          field<Spec, &Spec::slope_deg>("slope_deg", kRequired, Limits{0.0, 89.0},
                                        "Of the plane against the horizontal."),
          field<Spec, &Spec::azimuth_deg>("azimuth_deg", kOptional, Limits{-360.0, 360.0},
                                          "Of the direction down the slope (or of the motion, "
                                          "where it is level), from the x axis about z."),
          friction_field<Spec>()};
}

constexpr auto kFreeFlightKindFields = with_bounds<AnswerSpec<FreeFlight>>(
    std::array{body_field<AnswerSpec<FreeFlight>>()}, kMotionBounds);
constexpr ObjectTable kFreeFlight = object_table<AnswerSpec<FreeFlight>>(
    "free-flight", "A ballistic path; constant spin.", kFreeFlightKindFields);

constexpr auto kTorqueFreeKindFields = with_bounds<AnswerSpec<TorqueFree>>(
    std::array{body_field<AnswerSpec<TorqueFree>>()}, kMotionBounds);
constexpr ObjectTable kTorqueFree = object_table<AnswerSpec<TorqueFree>>(
    "torque-free",
    "Euler's equations without torque (Jacobi elliptic functions), with the attitude.",
    kTorqueFreeKindFields);

constexpr auto kSlidingKindFields =
    with_bounds<AnswerSpec<Sliding>>(slope_fields<AnswerSpec<Sliding>>(), kSlidingBounds);
constexpr ObjectTable kSliding =
    object_table<AnswerSpec<Sliding>>("sliding",
                                      "A box that slides down a slope through its first position, "
                                      "or stops on it. Gravity is along -z.",
                                      kSlidingKindFields);

constexpr std::array<Field, 5> rolling_fields() {
  const auto slope = slope_fields<AnswerSpec<Rolling>>();
  return {slope[0], slope[1], slope[2], slope[3],
          field<AnswerSpec<Rolling>, &AnswerSpec<Rolling>::rolling_friction_m>(
              "rolling_friction_m", kOptional, Limits{0.0, 1e5},
              "Of the pair. If > 0, the sphere rolls from the start, and friction is enough.")};
}
constexpr auto kRollingKindFields =
    with_bounds<AnswerSpec<Rolling>>(rolling_fields(), kMotionBounds);
constexpr ObjectTable kRolling = object_table<AnswerSpec<Rolling>>(
    "rolling",
    "A sphere that slides on a slope until it rolls, if friction is enough; or rolls until rolling "
    "friction stops it. Gravity is along -z.",
    kRollingKindFields);

constexpr auto kBouncingKindFields = with_bounds<AnswerSpec<Bouncing>>(
    std::array{body_field<AnswerSpec<Bouncing>>(), restitution_field<AnswerSpec<Bouncing>>()},
    kBounceBounds);
constexpr ObjectTable kBouncing =
    object_table<AnswerSpec<Bouncing>>("bouncing",
                                       "A sphere that bounces on a floor at z = 0 until it rests, "
                                       "after infinitely many bounces. Gravity is along -z.",
                                       kBouncingKindFields);

constexpr auto kTwoSpheresKindFields = with_bounds<AnswerSpec<TwoSpheres>>(
    std::array{body_field<AnswerSpec<TwoSpheres>>(),
               field<AnswerSpec<TwoSpheres>, &AnswerSpec<TwoSpheres>::other>(
                   "other", kRequired, kId, "Id of the other sphere."),
               restitution_field<AnswerSpec<TwoSpheres>>()},
    kMotionBounds);
constexpr ObjectTable kTwoSpheres = object_table<AnswerSpec<TwoSpheres>>(
    "two-spheres", "Two spheres without friction or gravity, before and after they meet.",
    kTwoSpheresKindFields);

constexpr auto kFloorImpactKindFields = with_bounds<AnswerSpec<FloorImpact>>(
    std::array{body_field<AnswerSpec<FloorImpact>>(), friction_field<AnswerSpec<FloorImpact>>(),
               restitution_field<AnswerSpec<FloorImpact>>()},
    kMotionBounds);
constexpr ObjectTable kFloorImpact = object_table<AnswerSpec<FloorImpact>>(
    "floor-impact",
    "A spinning sphere, without gravity, before and after it meets a floor at z = 0.",
    kFloorImpactKindFields);

constexpr auto kSphereLineKindFields =
    with_bounds<AnswerSpec<SphereLine>>(std::array<Field, 0>{}, kMotionBounds);
constexpr ObjectTable kSphereLine = object_table<AnswerSpec<SphereLine>>(
    "sphere-line",
    "All bodies are equal elastic spheres on a line along x: they pass their velocities on.",
    kSphereLineKindFields);

constexpr auto kSlidingRowKindFields =
    with_bounds<AnswerSpec<SlidingRow>>(std::array{friction_field<AnswerSpec<SlidingRow>>(),
                                                   restitution_field<AnswerSpec<SlidingRow>>()},
                                        kMotionBounds);
constexpr ObjectTable kSlidingRow = object_table<AnswerSpec<SlidingRow>>(
    "sliding-row",
    "All bodies are boxes in a row along x on a level floor: they slide along x, hit each other, "
    "faster than the restitution threshold, and stop. Gravity is along -z.",
    kSlidingRowKindFields);

constexpr auto kAtRestKindFields =
    with_bounds<AnswerSpec<AtRest>>(std::array<Field, 0>{}, kRestBounds);
constexpr ObjectTable kAtRest = object_table<AnswerSpec<AtRest>>(
    "at-rest", "All bodies stay where they are.", kAtRestKindFields);

constexpr auto kConservedKindFields =
    with_bounds<AnswerSpec<Conserved>>(std::array<Field, 0>{}, kInvariantBounds);
constexpr ObjectTable kConserved = object_table<AnswerSpec<Conserved>>(
    "conserved", "Nothing outside acts: energy and momenta keep their values.",
    kConservedKindFields);

constexpr auto kStackForcesKindFields =
    with_bounds<AnswerSpec<StackForces>>(std::array<Field, 0>{}, kStackBounds);
constexpr ObjectTable kStackForces = object_table<AnswerSpec<StackForces>>(
    "stack-forces",
    "A vertical stack of all bodies by id, upwards: every contact carries the weight above it.",
    kStackForcesKindFields);

constexpr auto kOneSideKindFields = with_bounds<AnswerSpec<OneSide>>(
    std::array{
        field<AnswerSpec<OneSide>, &AnswerSpec<OneSide>::normal>(
            "normal", kRequired, Limits{-1e6, 1e6}, "Points to the far side; any length but zero."),
        field<AnswerSpec<OneSide>, &AnswerSpec<OneSide>::offset_m>(
            "offset_m", kRequired, kPosition,
            "Distance of the plane from the origin along normal.")},
    kSideBounds);
constexpr ObjectTable kOneSide = object_table<AnswerSpec<OneSide>>(
    "one-side", "No body gets to the far side of a plane.", kOneSideKindFields);

constexpr auto kSeparationKindFields =
    with_bounds<AnswerSpec<Separation>>(std::array<Field, 0>{}, kPileBounds);
constexpr ObjectTable kSeparation = object_table<AnswerSpec<Separation>>(
    "separation",
    "Bodies that start inside each other come apart: penetration_m is that at the end.",
    kSeparationKindFields);

constexpr auto kPileKindFields = with_bounds<AnswerSpec<Pile>>(std::array<Field, 0>{}, kPileBounds);
constexpr ObjectTable kPile = object_table<AnswerSpec<Pile>>(
    "pile", "Invariants of a pile, which has no pointwise truth.", kPileKindFields);

constexpr auto kReversalKindFields =
    with_bounds<AnswerSpec<Reversal>>(std::array<Field, 0>{}, kMotionBounds);
constexpr ObjectTable kReversal =
    object_table<AnswerSpec<Reversal>>("reversal",
                                       "After the run all velocities are reversed and it runs "
                                       "again: the start comes back. Errors are against the start.",
                                       kReversalKindFields);

constexpr auto kHardSphereGasKindFields = with_bounds<AnswerSpec<HardSphereGas>>(
    std::array{field<AnswerSpec<HardSphereGas>, &AnswerSpec<HardSphereGas>::size_m>(
        "size_m", kRequired, kLength, "Of the box inside.")},
    kGasBounds);
constexpr ObjectTable kHardSphereGas = object_table<AnswerSpec<HardSphereGas>>(
    "hard-sphere-gas", "Equal elastic spheres in a closed box.", kHardSphereGasKindFields);

constexpr Field kStoredEndFields[] = {
    body_field<StoredEndSpec>(),
    field<StoredEndSpec, &StoredEndSpec::position_m>("position_m", kRequired, kPosition,
                                                     "Where its centre of mass was at the end."),
    choice_field<StoredEndSpec, &StoredEndSpec::orientation>(
        "orientation", kRequired, kNone, kOrientation, "Its orientation at the end."),
};
constexpr ObjectTable kStoredEnd = object_table<StoredEndSpec>(
    "stored-end", "Where a far more accurate run left a body.", kStoredEndFields);
constexpr auto kStoredRunKindFields = with_bounds<StoredRunSpec>(
    std::array{object_field<StoredRunSpec, &StoredRunSpec::ends>(
                   "ends", kRequired, list_of(1, 10'000), kStoredEnd,
                   "One for each body that is compared."),
               field<StoredRunSpec, &StoredRunSpec::error_m>(
                   "error_m", kRequired, Limits{0.0, 1e9},
                   "Error of the stored positions themselves, by halving their step.")},
    kMotionBounds);
constexpr ObjectTable kStoredRun = object_table<StoredRunSpec>(
    "stored-run", "Where a far more accurate run of this program ended.", kStoredRunKindFields);

constexpr ChoiceEntry kReferenceEntries[] = {
    choice_entry<ReferenceSpec, AnswerSpec<FreeFlight>>("free-flight", kFreeFlight),
    choice_entry<ReferenceSpec, AnswerSpec<TorqueFree>>("torque-free", kTorqueFree),
    choice_entry<ReferenceSpec, AnswerSpec<Sliding>>("sliding", kSliding),
    choice_entry<ReferenceSpec, AnswerSpec<Rolling>>("rolling", kRolling),
    choice_entry<ReferenceSpec, AnswerSpec<Bouncing>>("bouncing", kBouncing),
    choice_entry<ReferenceSpec, AnswerSpec<TwoSpheres>>("two-spheres", kTwoSpheres),
    choice_entry<ReferenceSpec, AnswerSpec<FloorImpact>>("floor-impact", kFloorImpact),
    choice_entry<ReferenceSpec, AnswerSpec<SphereLine>>("sphere-line", kSphereLine),
    choice_entry<ReferenceSpec, AnswerSpec<SlidingRow>>("sliding-row", kSlidingRow),
    choice_entry<ReferenceSpec, AnswerSpec<AtRest>>("at-rest", kAtRest),
    choice_entry<ReferenceSpec, AnswerSpec<Conserved>>("conserved", kConserved),
    choice_entry<ReferenceSpec, AnswerSpec<StackForces>>("stack-forces", kStackForces),
    choice_entry<ReferenceSpec, AnswerSpec<OneSide>>("one-side", kOneSide),
    choice_entry<ReferenceSpec, AnswerSpec<Separation>>("separation", kSeparation),
    choice_entry<ReferenceSpec, AnswerSpec<Pile>>("pile", kPile),
    choice_entry<ReferenceSpec, AnswerSpec<Reversal>>("reversal", kReversal),
    choice_entry<ReferenceSpec, AnswerSpec<HardSphereGas>>("hard-sphere-gas", kHardSphereGas),
    choice_entry<ReferenceSpec, AnswerSpec<ForcedFlight>>("forced-flight", kForcedFlight),
    choice_entry<ReferenceSpec, AnswerSpec<DampedOscillator>>("damped-oscillator",
                                                              kDampedOscillator),
    choice_entry<ReferenceSpec, AnswerSpec<SteadyPrecession>>("steady-precession",
                                                              kSteadyPrecession),
    choice_entry<ReferenceSpec, AnswerSpec<JointTravel>>("joint-travel", kJointTravel),
    choice_entry<ReferenceSpec, AnswerSpec<HangingChain>>("hanging-chain", kHangingChain),
    choice_entry<ReferenceSpec, AnswerSpec<JointsHold>>("joints-hold", kJointsHold),
    choice_entry<ReferenceSpec, StoredRunSpec>("stored-run", kStoredRun)};

}  // namespace

constexpr ChoiceTable kReference{
    .name = "reference",
    .doc = "Something that is known of the run beforehand, and how near a run must come to it.",
    .tag = "type",
    .entries = kReferenceEntries,
    .elsewhere = {},
    .elsewhere_hint = {}};

}  // namespace soda::scenarios
