#include "scenarios/reference_tables.hpp"

#include "scenarios/field_binding.hpp"
#include "scenarios/format_limits.hpp"
#include "scenarios/shape_tables.hpp"

namespace soda::scenarios {
namespace {

constexpr Limits kBound{0.0, 1e9};

template <auto M>
constexpr Field bound(std::string_view key, std::string_view doc) {
  return field<BoundsSpec, M>(key, kOptional, kBound, doc);
}

constexpr Field kPositionM = bound<&BoundsSpec::position_m>(
    "position_m", "Largest distance of a centre of mass from where it should be, at any step.");
constexpr Field kVelocityMS =
    bound<&BoundsSpec::velocity_m_s>("velocity_m_s", "Largest error of a velocity, at any step.");
constexpr Field kEndVelocityMS =
    bound<&BoundsSpec::end_velocity_m_s>("end_velocity_m_s", "Error of the velocities at the end.");
constexpr Field kAttitudeRad = bound<&BoundsSpec::attitude_rad>(
    "attitude_rad", "Largest angle between an orientation and the right one, at any step.");
constexpr Field kSpinRadS = bound<&BoundsSpec::spin_rad_s>(
    "spin_rad_s", "Largest error of an angular velocity, at any step.");
constexpr Field kEndSpinRadS = bound<&BoundsSpec::end_spin_rad_s>(
    "end_spin_rad_s", "Error of the angular velocities at the end.");
constexpr Field kSideM =
    bound<&BoundsSpec::side_m>("side_m", "Largest way out of the vertical plane of the motion.");
constexpr Field kLiftM = bound<&BoundsSpec::lift_m>(
    "lift_m", "Largest height over (or depth under) the slope, against the start.");
constexpr Field kStopTimeS =
    bound<&BoundsSpec::stop_time_s>("stop_time_s", "Error of the time at which it stops.");
constexpr Field kRestSpeedMS = bound<&BoundsSpec::rest_speed_m_s>(
    "rest_speed_m_s", "Speed at the end, when it should be at rest.");
constexpr Field kApexM =
    bound<&BoundsSpec::apex_m>("apex_m", "Largest error of the heights between bounces.");
constexpr Field kEnergyRel = bound<&BoundsSpec::energy_rel>(
    "energy_rel",
    "Largest change of kinetic and potential energy, over the energy scale of the run.");
constexpr Field kEnergyGainRel = bound<&BoundsSpec::energy_gain_rel>(
    "energy_gain_rel",
    "Largest gain of that energy over the start, likewise; losses do not count.");
constexpr Field kMomentumRel = bound<&BoundsSpec::momentum_rel>(
    "momentum_rel", "Largest change of momentum, over the sum of m |v| at the start.");
constexpr Field kAngularMomentumRel = bound<&BoundsSpec::angular_momentum_rel>(
    "angular_momentum_rel",
    "Largest change of angular momentum about the common centre of mass, over the sum of its parts "
    "at the start.");
constexpr Field kDisplacementRel = bound<&BoundsSpec::displacement_rel>(
    "displacement_rel", "position_m over the diameter of a ball of the body's volume.");
constexpr Field kPenetrationM =
    bound<&BoundsSpec::penetration_m>("penetration_m", "Deepest overlap at any step.");
constexpr Field kPenetrationP99M = bound<&BoundsSpec::penetration_p99_m>(
    "penetration_p99_m", "99 % of the contact points of all steps overlap less.");
constexpr Field kSpeedMS = bound<&BoundsSpec::speed_m_s>("speed_m_s", "Largest speed at any step.");
constexpr Field kPassed =
    bound<&BoundsSpec::passed>("passed", "Bodies on the far side at the end.");
constexpr Field kForceRel = bound<&BoundsSpec::force_rel>(
    "force_rel",
    "Largest error of a contact force over the last tenth of the run, over the weight above.");
constexpr Field kPressureRel =
    bound<&BoundsSpec::pressure_rel>("pressure_rel", "Error of the mean pressure on the walls.");
constexpr Field kSpeedsRel = bound<&BoundsSpec::speeds_rel>(
    "speeds_rel",
    "Largest distance of the distribution of velocity components from the normal one.");
constexpr Field kStepMs = bound<&BoundsSpec::step_ms>("step_ms", "CPU time of a step.");

constexpr Field kMotionFields[] = {kPositionM,   kVelocityMS,         kEndVelocityMS,
                                   kAttitudeRad, kSpinRadS,           kEndSpinRadS,
                                   kEnergyRel,   kAngularMomentumRel, kStepMs};
constexpr ObjectTable kMotionBounds =
    object_table<BoundsSpec>("motion-bounds", "Of a motion known in closed form.", kMotionFields);
constexpr Field kSlidingFields[] = {kPositionM, kVelocityMS,  kSideM, kLiftM,
                                    kStopTimeS, kRestSpeedMS, kStepMs};
constexpr ObjectTable kSlidingBounds =
    object_table<BoundsSpec>("sliding-bounds", "Of a body that slides.", kSlidingFields);
constexpr Field kBounceFields[] = {kPositionM, kApexM, kRestSpeedMS, kStepMs};
constexpr ObjectTable kBounceBounds =
    object_table<BoundsSpec>("bounce-bounds", "Of a ball that bounces.", kBounceFields);
constexpr Field kRestFields[] = {kPositionM,    kAttitudeRad, kDisplacementRel,
                                 kPenetrationM, kSpeedMS,     kStepMs};
constexpr ObjectTable kRestBounds =
    object_table<BoundsSpec>("rest-bounds", "Of bodies that should not move.", kRestFields);
constexpr Field kInvariantFields[] = {kEnergyRel, kEnergyGainRel, kMomentumRel, kAngularMomentumRel,
                                      kStepMs};
constexpr ObjectTable kInvariantBounds =
    object_table<BoundsSpec>("invariant-bounds", "Of what physics conserves.", kInvariantFields);
constexpr Field kStackFields[] = {kForceRel};
constexpr ObjectTable kStackBounds =
    object_table<BoundsSpec>("stack-bounds", "Of the forces in a stack.", kStackFields);
constexpr Field kSideFields[] = {kPassed, kEnergyGainRel, kStepMs};
constexpr ObjectTable kSideBounds =
    object_table<BoundsSpec>("side-bounds", "Of what must not get through.", kSideFields);
constexpr Field kPileFields[] = {kPenetrationM, kPenetrationP99M, kEnergyGainRel, kSpeedMS,
                                 kStepMs};
constexpr ObjectTable kPileBounds =
    object_table<BoundsSpec>("pile-bounds", "Of piles.", kPileFields);
constexpr Field kGasFields[] = {kPressureRel, kSpeedsRel, kStepMs};
constexpr ObjectTable kGasBounds = object_table<BoundsSpec>("gas-bounds", "Of a gas.", kGasFields);

// The fields of a kind of reference: its own, then its bounds.
template <class Spec, std::size_t N>
constexpr std::array<Field, N + 2> with_bounds(const std::array<Field, N>& own,
                                               const ObjectTable& bounds) {
  std::array<Field, N + 2> all{};
  for (std::size_t i = 0; i < N; ++i) all[i] = own[i];
  all[N] =
      object_field<Spec, &Spec::must>("must", kOptional, kNone, bounds, "What has to be reached.");
  all[N + 1] = object_field<Spec, &Spec::stretch>("stretch", kOptional, kNone, bounds,
                                                  "What the mathematics allows.");
  return all;
}

template <class Spec>
constexpr Field body_field() {
  return field<Spec, &Spec::body>("body", kRequired, kId, "Id of a body of the scene.");
}
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

constexpr auto kRollingKindFields =
    with_bounds<AnswerSpec<Rolling>>(slope_fields<AnswerSpec<Rolling>>(), kMotionBounds);
constexpr ObjectTable kRolling = object_table<AnswerSpec<Rolling>>(
    "rolling",
    "A sphere that slides on a slope until it rolls, if friction is enough. Gravity is along -z.",
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
    choice_entry<ReferenceSpec, AnswerSpec<AtRest>>("at-rest", kAtRest),
    choice_entry<ReferenceSpec, AnswerSpec<Conserved>>("conserved", kConserved),
    choice_entry<ReferenceSpec, AnswerSpec<StackForces>>("stack-forces", kStackForces),
    choice_entry<ReferenceSpec, AnswerSpec<OneSide>>("one-side", kOneSide),
    choice_entry<ReferenceSpec, AnswerSpec<Separation>>("separation", kSeparation),
    choice_entry<ReferenceSpec, AnswerSpec<Pile>>("pile", kPile),
    choice_entry<ReferenceSpec, AnswerSpec<Reversal>>("reversal", kReversal),
    choice_entry<ReferenceSpec, AnswerSpec<HardSphereGas>>("hard-sphere-gas", kHardSphereGas),
    choice_entry<ReferenceSpec, StoredRunSpec>("stored-run", kStoredRun)};

constexpr MeasureKey kMeasureKeys[] = {{"position_m", &BoundsSpec::position_m},
                                       {"velocity_m_s", &BoundsSpec::velocity_m_s},
                                       {"end_velocity_m_s", &BoundsSpec::end_velocity_m_s},
                                       {"attitude_rad", &BoundsSpec::attitude_rad},
                                       {"spin_rad_s", &BoundsSpec::spin_rad_s},
                                       {"end_spin_rad_s", &BoundsSpec::end_spin_rad_s},
                                       {"side_m", &BoundsSpec::side_m},
                                       {"lift_m", &BoundsSpec::lift_m},
                                       {"stop_time_s", &BoundsSpec::stop_time_s},
                                       {"rest_speed_m_s", &BoundsSpec::rest_speed_m_s},
                                       {"apex_m", &BoundsSpec::apex_m},
                                       {"energy_rel", &BoundsSpec::energy_rel},
                                       {"energy_gain_rel", &BoundsSpec::energy_gain_rel},
                                       {"momentum_rel", &BoundsSpec::momentum_rel},
                                       {"angular_momentum_rel", &BoundsSpec::angular_momentum_rel},
                                       {"displacement_rel", &BoundsSpec::displacement_rel},
                                       {"penetration_m", &BoundsSpec::penetration_m},
                                       {"penetration_p99_m", &BoundsSpec::penetration_p99_m},
                                       {"speed_m_s", &BoundsSpec::speed_m_s},
                                       {"passed", &BoundsSpec::passed},
                                       {"force_rel", &BoundsSpec::force_rel},
                                       {"pressure_rel", &BoundsSpec::pressure_rel},
                                       {"speeds_rel", &BoundsSpec::speeds_rel},
                                       {"step_ms", &BoundsSpec::step_ms}};

}  // namespace

constexpr ChoiceTable kReference{
    .name = "reference",
    .doc = "Something that is known of the run beforehand, and how near a run must come to it.",
    .tag = "type",
    .entries = kReferenceEntries,
    .elsewhere = {},
    .elsewhere_hint = {}};

std::span<const MeasureKey> measure_keys() { return kMeasureKeys; }

}  // namespace soda::scenarios
