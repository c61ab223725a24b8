#include "scenarios/run_tables.hpp"

#include "scenarios/field_binding.hpp"
#include "scenarios/format_limits.hpp"

namespace soda::scenarios {

template <>
inline constexpr std::array kNamesOf<physics::Broadphase> =
    std::to_array<std::string_view>({"grid", "all-pairs"});
template <>
inline constexpr std::array kNamesOf<physics::Narrowphase> =
    std::to_array<std::string_view>({"auto", "fcl", "own"});
template <>
inline constexpr std::array kNamesOf<models::MapKind> =
    std::to_array<std::string_view>({"blocks", "k-means", "paper", "statics"});
template <>
inline constexpr std::array kNamesOf<models::ExecutorKind> =
    std::to_array<std::string_view>({"sequential", "threads"});
template <>
inline constexpr std::array kNamesOf<models::BalancingPolicy> =
    std::to_array<std::string_view>({"off", "paper", "random"});

template <>
inline constexpr std::array kNamesOf<Quality> = std::to_array<std::string_view>({"fast", "balanced",
                                                                                 "accurate"});

namespace {

constexpr Field kSolverFields[] = {
    field<SolverSpec, &SolverSpec::quality>(
        "quality", kOptional, kNone,
        "fast: six substeps (more under load), one part a step for all but impacts, and blows left "
        "to the iterations where to share them out takes long; balanced: eight, and more parts "
        "where they are cheap; accurate: fifteen, and a tolerance of 1e-6 (accuracy)."),
    field<SolverSpec, &SolverSpec::iterations>("iterations", kOptional, Limits{1.0, 1000.0},
                                               "Iterations over the contacts of an island, or four "
                                               "times its substeps; by default what quality "
                                               "says: 24, 30 or 60."),
    field<SolverSpec, &SolverSpec::restitution_threshold_m_s>(
        "restitution_threshold_m_s", kOptional, Limits{0.0, 1e6}, "Slower impacts do not bounce."),
    field<SolverSpec, &SolverSpec::push_out_1_s>(
        "push_out_1_s", kOptional, Limits{1e-6, 1e6},
        "Widths of the wider body a second that position correction moves a body by, at most."),
    field<SolverSpec, &SolverSpec::contact_response>(
        "contact_response", kOptional, kNone,
        "false: contacts are found but bodies pass through each other."),
    field<SolverSpec, &SolverSpec::warm_starting>("warm_starting", kOptional, kNone,
                                                  "Start from the impulses of the step before."),
    field<SolverSpec, &SolverSpec::direct>(
        "direct", kOptional, kNone,
        "Newton's method for the islands that it pays for; false: for none."),
    field<SolverSpec, &SolverSpec::rest>(
        "rest", kOptional, kNone,
        "Islands that do not move are left as they are; false: all are solved in each step."),
    field<SolverSpec, &SolverSpec::broadphase>(
        "broadphase", kOptional, kNone,
        "How candidate pairs are found; all-pairs is for experiments on cost."),
    field<SolverSpec, &SolverSpec::narrowphase>(
        "narrowphase", kOptional, kNone,
        "Whose routine says along which direction two solids meet. auto: FCL's for two boxes, own "
        "ones for all others; fcl: FCL's for all but halfspaces and meshes; own: no FCL."),
};

constexpr Field kAccuracyFields[] = {
    field<AccuracySpec, &AccuracySpec::tolerance>(
        "tolerance", kRequired, Limits{1e-12, 1e-2},
        "Largest error of an island in a step, of the width of each of its bodies."),
};

constexpr Field kTerritoryFields[] = {
    field<TerritorySpec, &TerritorySpec::origin_m>("origin_m", kRequired, kPosition,
                                                   "Least corner of the grid."),
    field<TerritorySpec, &TerritorySpec::cell_size_m>("cell_size_m", kRequired, Limits{1e-3, 1e9},
                                                      "Edge of the cubic cells."),
    field<TerritorySpec, &TerritorySpec::cells>(
        "cells", kRequired, Limits{1.0, static_cast<double>(kMaxCells)},
        "Cells along x, y, z; at most 10,000,000 together. What lies outside belongs to the "
        "nearest cell."),
    field<TerritorySpec, &TerritorySpec::worlds>(
        "worlds", kOptional, Limits{1.0, static_cast<double>(kMaxCells)},
        "Worlds among which the cells are divided; at most as many as cells."),
    field<TerritorySpec, &TerritorySpec::map>(
        "map", kOptional, kNone,
        "blocks: boxes of nearly equal cell counts; k-means: equal-size clusters of the bodies, "
        "borders midway between them; paper: columns in equal numbers about such clusters, with "
        "ragged borders; statics: boxes, cut where static boxes leave the least room."),
    field<TerritorySpec, &TerritorySpec::seed>("seed", kOptional, kSeed,
                                               "Seed of k-means and paper."),
};

constexpr Field kExecutorFields[] = {
    field<ExecutorSpec, &ExecutorSpec::kind>("kind", kRequired, kNone,
                                             "sequential: the oracle; threads: Time Warp."),
    field<ExecutorSpec, &ExecutorSpec::threads>("threads", kOptional, Limits{1.0, 1024.0},
                                                "Worker threads, of the threads executor."),
    field<ExecutorSpec, &ExecutorSpec::scheduling_seed>(
        "scheduling_seed", kOptional, kSeed, "Shuffles the scheduling; cannot change results."),
};

constexpr Field kBalancingFields[] = {
    field<BalancingSpec, &BalancingSpec::policy>(
        "policy", kRequired, kNone,
        "paper: cells go from loaded worlds to their neighbours; random is for tests."),
    field<BalancingSpec, &BalancingSpec::interval_steps>("interval_steps", kOptional,
                                                         Limits{1.0, double{kMaxBalancingInterval}},
                                                         "Steps between two decisions."),
    field<BalancingSpec, &BalancingSpec::seed>("seed", kOptional, kSeed, "Of the random policy."),
};

constexpr Field kOutputFields[] = {
    field<OutputSpec, &OutputSpec::log>(
        "log", kOptional, kText,
        "Event log to write, below the folder of the scenario; --log comes first."),
    field<OutputSpec, &OutputSpec::step_digests>("step_digests", kOptional, kNone,
                                                 "Report the digest of every step."),
};

}  // namespace

constexpr ObjectTable kSolver =
    object_table<SolverSpec>("solver", "Settings of the contact solver.", kSolverFields);

constexpr ObjectTable kAccuracy = object_table<AccuracySpec>(
    "accuracy", "Accuracy mode: steps are refined to a tolerance, and their errors reported.",
    kAccuracyFields);

constexpr ObjectTable kTerritory = object_table<TerritorySpec>(
    "territory", "The division of space among worlds.", kTerritoryFields);

constexpr ObjectTable kExecutor =
    object_table<ExecutorSpec>("executor", "What drives the worlds.", kExecutorFields);

constexpr ObjectTable kBalancing = object_table<BalancingSpec>(
    "balancing", "How territories change while a run goes on; cannot change results.",
    kBalancingFields);

constexpr ObjectTable kOutput =
    object_table<OutputSpec>("output", "What a run writes beside its report.", kOutputFields);

}  // namespace soda::scenarios
