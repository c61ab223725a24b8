// A game of two players over a network that is slow: rollback netcode.
//
// Each player has a simulation of its own and never waits. A frame is simulated with the player's
// own input and a guess of the other's: that it does what it did. When the input comes, 1 to 12
// frames late and in any order, and the guess was wrong, the simulation goes back to the snapshot
// before that frame and makes the frames since once more. As equal inputs give equal bits, both
// end up with the same game, though nothing but inputs was sent.
//
// game_loop [FRAMES]
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>
#include <random>
#include <soda/simulation.hpp>
#include <vector>

namespace {

constexpr int kMostDelay = 12;                // frames
constexpr std::uint32_t kPlayers[] = {1, 2};  // ids of their bodies
constexpr double kPush_newton_s = 0.25;

// Two balls among crates on a floor, in a fence.
soda::Scene make_arena() {
  soda::SceneParts arena;
  arena.name = "arena";
  arena.quality = "fast";
  arena.materials = {{.name = "rubber", .friction = 0.6, .restitution = 0.3},
                     {.name = "wood", .friction = 0.4}};
  arena.statics.push_back({.name = "floor", .shape = soda::HalfSpace{}, .material = "wood"});
  for (const double side : {-1.0, 1.0}) {
    arena.statics.push_back({.name = side < 0.0 ? "west" : "east",
                             .shape = soda::HalfSpace{{-side, 0.0, 0.0}, -5.0},
                             .material = "wood"});
    arena.statics.push_back({.name = side < 0.0 ? "south" : "north",
                             .shape = soda::HalfSpace{{0.0, -side, 0.0}, -5.0},
                             .material = "wood"});
  }
  for (const std::uint32_t player : kPlayers)
    arena.bodies.push_back({.id = player,
                            .shape = soda::Sphere{0.4},
                            .material = "rubber",
                            .mass_kg = 2.0,
                            .position_m = {player == 1 ? -3.0 : 3.0, 0.0, 0.4},
                            .angular_damping_1_s = 1.0});
  for (std::uint32_t i = 0; i < 12; ++i)
    arena.bodies.push_back({.id = 10 + i,
                            .shape = soda::Box{{0.6, 0.6, 0.6}},
                            .material = "wood",
                            .mass_kg = 1.0,
                            .position_m = {-1.5 + 1.0 * (i % 4), -1.0 + 1.0 * (i / 4), 0.3}});
  return soda::Scene::build(arena);
}

// What a player holds down in a frame.
struct Stick {
  double x = 0.0, y = 0.0;
  friend bool operator==(const Stick&, const Stick&) = default;
};

// What a player will do: it changes its mind every now and then.
std::vector<Stick> script(int frames, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<Stick> sticks;
  Stick stick;
  for (int frame = 0; frame < frames; ++frame) {
    if (random() % 12 == 0)
      stick = {static_cast<double>(random() % 3) - 1.0, static_cast<double>(random() % 3) - 1.0};
    sticks.push_back(stick);
  }
  return sticks;
}

struct Costs {
  int rollbacks = 0, frames_again = 0, deepest = 0;
  double total_us = 0.0, most_us = 0.0;
};

class Peer {
 public:
  Peer(const soda::Scene& arena, int own) : game_(arena), own_(own), before_(kMostDelay + 2) {}

  // The other's stick of an earlier frame.
  void receive(int frame, const Stick& stick) {
    if (!(guess(frame) == stick)) wrong_from_ = std::min(wrong_from_.value_or(frame), frame);
    known_.emplace(frame, stick);
  }

  void advance(int frame, const Stick& own) {
    sticks_.push_back(own);
    if (wrong_from_) go_back(*wrong_from_, frame);
    wrong_from_.reset();
    simulate(frame);
    confirm(frame);
  }

  const std::vector<std::uint64_t>& confirmed() const { return confirmed_; }
  const Costs& costs() const { return costs_; }
  std::size_t snapshot_bytes() const { return before_.front().bytes.size(); }

 private:
  // Of a frame whose stick is not known: the last before it that is.
  Stick guess(int frame) const {
    const auto later = known_.upper_bound(frame);
    return later == known_.begin() ? Stick{} : std::prev(later)->second;
  }

  void simulate(int frame) {
    game_.snapshot(before_[static_cast<std::size_t>(frame) % before_.size()]);
    for (int player = 0; player < 2; ++player) {
      const Stick stick = player == own_ ? sticks_[static_cast<std::size_t>(frame)] : guess(frame);
      if (stick == Stick{}) continue;
      game_.apply({.id = kPlayers[player],
                   .step = frame,
                   .action = soda::Push{.body = kPlayers[player],
                                        .impulse_newton_s = {kPush_newton_s * stick.x,
                                                             kPush_newton_s * stick.y, 0.0}}});
    }
    game_.step();
    digests_[frame] = game_.digest();
  }

  void go_back(int to, int frame) {
    const auto start = std::chrono::steady_clock::now();
    game_.restore(before_[static_cast<std::size_t>(to) % before_.size()]);
    for (int again = to; again < frame; ++again) simulate(again);
    const double us =
        std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count();
    ++costs_.rollbacks;
    costs_.frames_again += frame - to;
    costs_.deepest = std::max(costs_.deepest, frame - to);
    costs_.total_us += us;
    costs_.most_us = std::max(costs_.most_us, us);
  }

  // A frame is final when both sticks of it and of all before are known.
  void confirm(int frame) {
    for (int next = static_cast<int>(confirmed_.size()); next <= frame && known_.contains(next);
         ++next) {
      confirmed_.push_back(digests_.at(next));
      digests_.erase(next);
    }
  }

  soda::Simulation game_;
  const int own_;
  std::vector<soda::Snapshot> before_;  // by frame, those that may be gone back to
  std::vector<Stick> sticks_;           // own
  std::map<int, Stick> known_;          // the other's
  std::optional<int> wrong_from_;
  std::map<int, std::uint64_t> digests_;  // of frames that are not final
  std::vector<std::uint64_t> confirmed_;
  Costs costs_;
};

}  // namespace

int main(int argc, char** argv) {
  const int frames = argc > 1 ? std::atoi(argv[1]) : 10'000;
  const soda::Scene arena = make_arena();
  std::array<Peer, 2> peers{Peer(arena, 0), Peer(arena, 1)};
  const std::array sticks{script(frames, 11), script(frames, 22)};
  std::mt19937 network(33);
  // By frame of arrival and player: the frames whose stick comes then.
  std::map<int, std::array<std::vector<int>, 2>> under_way;
  for (int frame = 0; frame < frames; ++frame) {
    for (int player = 0; player < 2; ++player) {
      const int other = 1 - player;
      for (const int sent : under_way[frame][other])
        peers[player].receive(sent, sticks[other][static_cast<std::size_t>(sent)]);
    }
    under_way.erase(frame);
    for (int player = 0; player < 2; ++player) {
      peers[player].advance(frame, sticks[player][static_cast<std::size_t>(frame)]);
      under_way[frame + 1 + static_cast<int>(network() % kMostDelay)][player].push_back(frame);
    }
  }
  const std::size_t both = std::min(peers[0].confirmed().size(), peers[1].confirmed().size());
  std::size_t different = 0;
  for (std::size_t frame = 0; frame < both; ++frame)
    different += peers[0].confirmed()[frame] != peers[1].confirmed()[frame] ? 1 : 0;
  std::printf("%d frames, %zu confirmed by both, %zu different\n", frames, both, different);
  for (const Peer& peer : peers)
    std::printf(
        "rollbacks %d, deepest %d frames, frames made again %d, a rollback %.0f us on the "
        "mean and %.0f at most, a snapshot %zu bytes\n",
        peer.costs().rollbacks, peer.costs().deepest, peer.costs().frames_again,
        peer.costs().total_us / std::max(peer.costs().rollbacks, 1), peer.costs().most_us,
        peer.snapshot_bytes());
  const bool complete = both + kMostDelay + 1 >= static_cast<std::size_t>(frames);
  const bool proves = peers[0].costs().rollbacks > 0 && peers[0].costs().deepest == kMostDelay;
  return different == 0 && complete && proves ? 0 : 1;
}
