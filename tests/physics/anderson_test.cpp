#include "physics/math/anderson.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace soda::physics {
namespace {

// x <- rate * (x - at) + at, each component by itself.
struct Linear {
  std::vector<double> rates, at;

  std::vector<double> operator()(const std::vector<double>& x) const {
    std::vector<double> found(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) found[i] = rates[i] * (x[i] - at[i]) + at[i];
    return found;
  }
  double off(const std::vector<double>& x) const {
    double most = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) most = std::max(most, std::abs(x[i] - at[i]));
    return most;
  }
};

// By itself, the slowest takes thousands.
TEST(AndersonAcceleration, FindsWhereAFewSlowDirectionsLead) {
  for (const std::vector<double>& rates :
       {std::vector<double>{0.999}, {0.9, 0.999}, {0.5, 0.99, 0.9}, {-0.9, 0.9, 1.2}}) {
    const Linear map{rates, std::vector<double>(rates.size(), 3.0)};
    AndersonAcceleration acceleration;
    std::vector<double> x(rates.size(), -20.0);
    for (int i = 0; i < 8; ++i) {
      std::vector<double> found = map(x);
      acceleration.accelerate(x, found);
      x = found;
    }
    EXPECT_LE(map.off(x), 1e-9) << rates.size() << " directions, " << rates.back();
  }
}

TEST(AndersonAcceleration, KnowsNothingBeforeTheSecondIterationAndAfterARestart) {
  const Linear map{{0.9, 0.5}, {1.0, 2.0}};
  AndersonAcceleration acceleration;
  const std::vector<double> first{5.0, 7.0}, second = map(first);
  std::vector<double> found = map(first);
  acceleration.accelerate(first, found);
  EXPECT_EQ(found, map(first));
  acceleration.restart();
  found = map(second);
  acceleration.accelerate(second, found);
  EXPECT_EQ(found, map(second));
}

TEST(AndersonAcceleration, WhatIsRememberedIsUsedLater) {
  const Linear map{{0.99}, {4.0}};
  AndersonAcceleration acceleration;
  const std::vector<double> first{10.0}, second = map(first);
  acceleration.remember(first, second);
  std::vector<double> found = map(second);
  acceleration.accelerate(second, found);
  EXPECT_LE(map.off(found), 1e-9);
}

// An iteration that stands still has no direction to go on along.
TEST(AndersonAcceleration, StaysWhereNothingChanges) {
  const Linear map{{0.5, 0.5}, {1.0, 2.0}};
  AndersonAcceleration acceleration;
  for (int i = 0; i < 5; ++i) {
    std::vector<double> found = map(map.at);
    acceleration.accelerate(map.at, found);
    EXPECT_EQ(found, map.at);
  }
}

}  // namespace
}  // namespace soda::physics
