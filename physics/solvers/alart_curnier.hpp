// Newton's method on the contact laws themselves, from near their solution (P. Alart, A. Curnier,
// Comput. Methods Appl. Mech. Eng. 92, 1991). With y = start + (target - u) / compliance at a
// point: it is open where y does not press; else its normal impulse is that of y, and its friction
// that of y, in the disc that the normal impulse allows. What slides makes the matrix unsymmetric.
// Start impulses as in start_impulses.hpp, so that the compliance is taken out meanwhile.
#pragma once

#include <span>
#include <vector>

#include "physics/math/anderson.hpp"
#include "physics/math/block_lu.hpp"
#include "physics/solvers/convex_contacts.hpp"
#include "physics/solvers/newton_solver.hpp"
#include "physics/solvers/start_impulses.hpp"

namespace soda::physics {

class AlartCurnier {
 public:
  // `targets` of the points: without the shift that the convex problem needs. `limits`, `plan` and
  // `bodies` have to last.
  AlartCurnier(const NewtonLimits& limits, const Elimination& plan, const ConvexContacts& problem,
               BodyBlocks& bodies, std::span<const Vec3> targets);

  // From these twists and impulses on, by `least` factorisations, or `most` once an error is
  // accepted: to the wanted error, or where it comes no nearer to one that is rounding or accepted
  // then. False, and nothing changed, where it does not come as near.
  bool solve(int least, int most, std::vector<Twist>& twists, Responses& responses);

  int factorisations() const { return factorisations_; }

 private:
  // How far it has come.
  struct Progress {
    double best_m_s = 1e300, accepted_m_s = 1e300;  // errors
    int no_nearer = 0;                              // steps since the best
    int releases = 0;
    bool is_fast = false;  // the last step took most of the gradient away
    StartCorrection last;
    std::vector<ContactMode> last_modes;
  };
  void update();
  bool fits_factor() const;
  bool refactor();
  void find_direction();
  void move(double step);
  double step(double before_m_s);
  bool judge(double gradient_m_s, const StartCorrection& found, Progress& progress) const;
  bool start_again(double gradient_m_s, const StartCorrection& found, Progress& progress);
  double growths_until_release() const;

  const NewtonLimits& limits_;
  const Elimination& plan_;
  ConvexContacts problem_;
  BodyBlocks& bodies_;
  std::vector<Twist> twists_, gradient_;
  Responses responses_;
  BlockMatrix factor_;
  std::vector<ContactMode> factor_modes_;
  std::vector<TurningResponse> factor_turnings_;
  std::vector<bool> factor_held_;  // of the rows
  std::vector<BlockVector> values_;
  std::vector<double> were_, found_;  // start impulses as they were, and as they are found
  AndersonAcceleration acceleration_;
  int factorisations_ = 0;
};

}  // namespace soda::physics
