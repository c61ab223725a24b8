#include "scenarios/joint_reference_tables.hpp"

#include "scenarios/bound_tables.hpp"

namespace soda::scenarios {

constexpr auto kForcedFlightFields = with_bounds<AnswerSpec<ForcedFlight>>(
    std::array{body_field<AnswerSpec<ForcedFlight>>()}, kMotionBounds);
constexpr ObjectTable kForcedFlight = object_table<AnswerSpec<ForcedFlight>>(
    "forced-flight",
    "Gravity, constant forces and torque, and damping, of a body that touches nothing. The "
    "attitude is compared where the spin stays about one principal axis.",
    kForcedFlightFields);

constexpr auto kDampedOscillatorFields = with_bounds<AnswerSpec<DampedOscillator>>(
    std::array{body_field<AnswerSpec<DampedOscillator>>(),
               field<AnswerSpec<DampedOscillator>, &AnswerSpec<DampedOscillator>::friction>(
                   "friction", kOptional, Limits{0.0, 100.0},
                   "Coulomb coefficient of it and the level floor that it slides on.")},
    kMotionBounds);
constexpr ObjectTable kDampedOscillator = object_table<AnswerSpec<DampedOscillator>>(
    "damped-oscillator",
    "A body on one spring between its centre and the world, along which it moves. With friction, "
    "damping must let it swing.",
    kDampedOscillatorFields);

constexpr auto kSteadyPrecessionFields = with_bounds<AnswerSpec<SteadyPrecession>>(
    std::array{body_field<AnswerSpec<SteadyPrecession>>(),
               field<AnswerSpec<SteadyPrecession>, &AnswerSpec<SteadyPrecession>::precession_rad_s>(
                   "precession_rad_s", kRequired, kSpeed, "About the upward vertical.")},
    kMotionBounds);
constexpr ObjectTable kSteadyPrecession = object_table<AnswerSpec<SteadyPrecession>>(
    "steady-precession",
    "A heavy symmetric top on a ball joint with the world that keeps its angle to the vertical.",
    kSteadyPrecessionFields);

constexpr auto kJointTravelFields = with_bounds<AnswerSpec<JointTravel>>(
    std::array{body_field<AnswerSpec<JointTravel>>()}, kMotionBounds);
constexpr ObjectTable kJointTravel = object_table<AnswerSpec<JointTravel>>(
    "joint-travel",
    "A body on a slider or hinge with the world: motor, stops and, along a slider, gravity.",
    kJointTravelFields);

constexpr auto kHangingChainFields =
    with_bounds<AnswerSpec<HangingChain>>(std::array<Field, 0>{}, kChainBounds);
constexpr ObjectTable kHangingChain =
    object_table<AnswerSpec<HangingChain>>("hanging-chain",
                                           "All bodies by id, downwards from the joint with the "
                                           "world: every joint carries the weight below it.",
                                           kHangingChainFields);

constexpr auto kJointsHoldFields =
    with_bounds<AnswerSpec<JointsHold>>(std::array<Field, 0>{}, kJointBounds);
constexpr ObjectTable kJointsHold =
    object_table<AnswerSpec<JointsHold>>("joints-hold", "No joint comes apart.", kJointsHoldFields);

}  // namespace soda::scenarios
