#include "scenarios/bound_tables.hpp"

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
constexpr Field kEndPositionM = bound<&BoundsSpec::end_position_m>(
    "end_position_m", "Distance of a centre of mass from where it should be at the end.");
constexpr Field kGapM =
    bound<&BoundsSpec::gap_m>("gap_m", "Largest distance by which a joint is apart, at any step.");
constexpr Field kMotionFields[] = {kPositionM,          kEndPositionM, kVelocityMS,  kEndVelocityMS,
                                   kAttitudeRad,        kSpinRadS,     kEndSpinRadS, kEnergyRel,
                                   kAngularMomentumRel, kStepMs};
constexpr Field kSlidingFields[] = {kPositionM, kVelocityMS,  kSideM, kLiftM,
                                    kStopTimeS, kRestSpeedMS, kStepMs};
constexpr Field kBounceFields[] = {kPositionM, kApexM, kRestSpeedMS, kStepMs};
constexpr Field kRestFields[] = {kPositionM,    kAttitudeRad, kDisplacementRel,
                                 kPenetrationM, kSpeedMS,     kStepMs};
constexpr Field kInvariantFields[] = {kEnergyRel, kEnergyGainRel, kMomentumRel, kAngularMomentumRel,
                                      kStepMs};
constexpr Field kStackBoundFields[] = {kForceRel};
constexpr Field kSideFields[] = {kPassed, kEnergyGainRel, kStepMs};
constexpr Field kPileFields[] = {kPenetrationM, kPenetrationP99M, kEnergyGainRel, kSpeedMS,
                                 kStepMs};
constexpr Field kGasBoundFields[] = {kPressureRel, kSpeedsRel, kStepMs};
constexpr Field kChainBoundFields[] = {kGapM, kForceRel, kStepMs};
constexpr Field kJointFields[] = {kGapM, kStepMs};

constexpr MeasureKey kMeasureKeys[] = {{"position_m", &BoundsSpec::position_m},
                                       {"end_position_m", &BoundsSpec::end_position_m},
                                       {"gap_m", &BoundsSpec::gap_m},
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

constexpr ObjectTable kMotionBounds =
    object_table<BoundsSpec>("motion-bounds", "Of a motion known in closed form.", kMotionFields);
constexpr ObjectTable kSlidingBounds =
    object_table<BoundsSpec>("sliding-bounds", "Of a body that slides.", kSlidingFields);
constexpr ObjectTable kBounceBounds =
    object_table<BoundsSpec>("bounce-bounds", "Of a ball that bounces.", kBounceFields);
constexpr ObjectTable kRestBounds =
    object_table<BoundsSpec>("rest-bounds", "Of bodies that should not move.", kRestFields);
constexpr ObjectTable kInvariantBounds =
    object_table<BoundsSpec>("invariant-bounds", "Of what physics conserves.", kInvariantFields);
constexpr ObjectTable kStackBounds =
    object_table<BoundsSpec>("stack-bounds", "Of the forces in a stack.", kStackBoundFields);
constexpr ObjectTable kSideBounds =
    object_table<BoundsSpec>("side-bounds", "Of what must not get through.", kSideFields);
constexpr ObjectTable kPileBounds =
    object_table<BoundsSpec>("pile-bounds", "Of piles.", kPileFields);
constexpr ObjectTable kGasBounds =
    object_table<BoundsSpec>("gas-bounds", "Of a gas.", kGasBoundFields);
constexpr ObjectTable kChainBounds =
    object_table<BoundsSpec>("chain-bounds", "Of a chain that hangs.", kChainBoundFields);
constexpr ObjectTable kJointBounds =
    object_table<BoundsSpec>("joint-bounds", "Of bodies that joints hold.", kJointFields);

std::span<const MeasureKey> measure_keys() { return kMeasureKeys; }

}  // namespace soda::scenarios
