#include "analysis/accuracy/judge.hpp"

#include "analysis/accuracy/joint_forms.hpp"
#include "analysis/accuracy/joint_judges.hpp"
#include "analysis/accuracy/motion_judges.hpp"
#include "analysis/accuracy/scene_judges.hpp"
#include "analysis/accuracy/sliding_row.hpp"
#include "scenarios/references.hpp"

namespace soda::analysis {
namespace {

using namespace scenarios;

// The judge of each kind of answer.
struct MakeJudge {
  const Scenario& scenario;
  double dt_s, duration_s;
  using Made = std::unique_ptr<Judge>;

  double gravity() const { return scenario.scene.gravity_m_s2.norm(); }
  StartingBody body(std::int64_t label) const {
    return starting_body(scenario, id_of_label(scenario, label));
  }
  Made one(std::int64_t label, MotionAt exact) const {
    return judge_motions({MotionTrack(id_of_label(scenario, label), std::move(exact))});
  }

  Made operator()(const FreeFlight& a) const {
    return one(a.body, free_flight(body(a.body), scenario.scene.gravity_m_s2));
  }
  Made operator()(const TorqueFree& a) const {
    return judge_torque_free(body(a.body), id_of_label(scenario, a.body));
  }
  Made operator()(const Sliding& a) const { return judge_sliding(scenario, a); }
  Made operator()(const Rolling& a) const {
    return one(a.body, rolling(body(a.body), gravity(), a));
  }
  Made operator()(const Bouncing& a) const { return judge_bouncing(scenario, a, dt_s, duration_s); }
  Made operator()(const TwoSpheres& a) const {
    std::vector<MotionAt> motions =
        two_spheres(body(a.body), body(a.other), scenario.scene.gravity_m_s2, a.restitution);
    return judge_motions({MotionTrack(id_of_label(scenario, a.body), motions[0]),
                          MotionTrack(id_of_label(scenario, a.other), motions[1])});
  }
  Made operator()(const FloorImpact& a) const { return one(a.body, floor_impact(body(a.body), a)); }
  std::vector<StartingBody> all_bodies() const {
    std::vector<StartingBody> bodies;
    for (std::uint32_t i = 0; i < scenario.initial.size(); ++i)
      bodies.push_back(starting_body(scenario, physics::BodyId{i}));
    return bodies;
  }
  Made all(const std::vector<MotionAt>& motions) const {
    std::vector<MotionTrack> tracks;
    for (std::uint32_t i = 0; i < motions.size(); ++i)
      tracks.emplace_back(physics::BodyId{i}, motions[i]);
    return judge_motions(std::move(tracks));
  }
  Made operator()(const SphereLine&) const { return all(sphere_line(all_bodies())); }
  Made operator()(const SlidingRow& a) const {
    std::vector<double> half_m;
    for (const physics::BodyParams& body : scenario.scene.bodies)
      half_m.push_back(
          std::get<physics::Box>(scenario.scene.shapes[body.shape]).half_extents_m.x());
    return all(sliding_row(all_bodies(), half_m, gravity(), a));
  }
  Made operator()(const AtRest&) const { return judge_rest(scenario); }
  Made operator()(const Conserved&) const { return judge_conserved(scenario); }
  Made operator()(const StackForces&) const {
    return judge_stack_forces(scenario, dt_s, duration_s);
  }
  Made operator()(const OneSide& a) const { return judge_side(scenario, a); }
  Made operator()(const Separation&) const { return judge_pile(scenario, true); }
  Made operator()(const Pile&) const { return judge_pile(scenario, false); }
  Made operator()(const Reversal&) const { return judge_return(scenario); }
  Made operator()(const HardSphereGas& a) const { return judge_gas(scenario, a, dt_s); }
  Made operator()(const ForcedFlight& a) const {
    const StartingBody start = body(a.body);
    const std::uint32_t forces = start.params.forces;
    const physics::BodyForces own =
        forces == physics::kNone ? physics::BodyForces{} : scenario.scene.forces[forces];
    return one(a.body, forced_flight(start, own, scenario.scene.gravity_m_s2));
  }
  const physics::Joint& joint(std::int64_t label) const {
    return *joint_with_world(scenario.scene, label);
  }
  Made operator()(const DampedOscillator& a) const {
    return one(a.body, damped_oscillator(body(a.body), joint(a.body), scenario.scene.gravity_m_s2,
                                         a.friction));
  }
  Made operator()(const SteadyPrecession& a) const {
    return one(a.body, steady_precession(body(a.body), joint(a.body), scenario.scene.gravity_m_s2,
                                         a.precession_rad_s));
  }
  Made operator()(const JointTravel& a) const {
    return one(a.body, joint_travel(body(a.body), joint(a.body), scenario.scene.gravity_m_s2));
  }
  Made operator()(const HangingChain&) const {
    return judge_hanging_chain(scenario, dt_s, duration_s);
  }
  Made operator()(const JointsHold&) const { return judge_joints(scenario); }
  Made operator()(const StoredRun& a) const { return judge_end(scenario, a.ends); }
};

}  // namespace

std::unique_ptr<Judge> make_judge(const Scenario& scenario, const Reference& reference, double dt_s,
                                  double duration_s) {
  return std::visit(MakeJudge{scenario, dt_s, duration_s}, reference.answer);
}

bool wants_reversal(const Reference& reference) {
  return std::holds_alternative<Reversal>(reference.answer);
}

}  // namespace soda::analysis
