// SPDX-License-Identifier: Apache-2.0
#include "app/robot/smooth_path.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace tendril::app {
namespace {

constexpr double kSame = 1e-9;      // m; waypoints that are nearer are one
constexpr double kStraight = 1e-9;  // rad; less is no corner

/// The largest value from low, where something holds, to high at which it still holds.
double largest(double low, double high, const std::function<bool(double)>& holds) {
  if (holds(high)) return high;
  for (double middle = (low + high) / 2; low < middle && middle < high; middle = (low + high) / 2)
    (holds(middle) ? low : high) = middle;
  return low;
}

/// A waypoint and the leg that leads on from it.
struct Vertex {
  std::size_t label;
  rt::EffectorVector position, direction;  // of the leg
  double length = 0;                       // of the leg, m
  double turn = 0;                         // |change of direction| at the waypoint, 0 to 2
  double speed = 0;                        // at the waypoint, m/s
};

class Corners {
 public:
  Corners(const std::vector<rt::EffectorVector>& waypoints, bool closed, double tolerance,
          const MotionLimits& limits)
      : closed_(closed), limits_(limits) {
    for (std::size_t k = 0; k < waypoints.size(); ++k)
      if (vertices_.empty() || (waypoints[k] - vertices_.back().position).norm() > kSame)
        vertices_.push_back({k, waypoints[k], {}});
    while (closed && vertices_.size() > 1 &&
           (vertices_.back().position - vertices_.front().position).norm() <= kSame)
      vertices_.pop_back();
    if (vertices_.size() < 2) return;
    for (std::size_t k = 0; k < legs(); ++k) {
      Vertex& vertex = vertices_[k];
      const rt::EffectorVector way = next(k).position - vertex.position;
      vertex.length = way.norm();
      vertex.direction = way / vertex.length;
    }
    for (std::size_t k = 0; k < vertices_.size(); ++k)
      if (closed || (k > 0 && k + 1 < vertices_.size())) set_speed(k, tolerance);
    while (slow_down()) continue;
  }

  std::size_t count() const { return vertices_.size(); }
  std::size_t legs() const { return closed_ ? count() : count() - 1; }
  const Vertex& at(std::size_t k) const { return vertices_[k % count()]; }
  const Vertex& next(std::size_t k) const { return at(k + 1); }

  /// How far from the waypoint its curve begins and ends, m.
  double reach(const Vertex& vertex, double speed) const {
    return speed * ramp_time(speed * vertex.turn, limits_) / 2;
  }
  double reach(std::size_t k) const { return reach(at(k), at(k).speed); }

 private:
  /// How far the curve stays from the waypoint, m: what half a ramp of the velocity moves.
  double cut(const Vertex& vertex, double speed) const {
    const double J = limits_.jerk, T = ramp_time(speed * vertex.turn, limits_);
    const double rise = std::min(limits_.acceleration / J, T / 2), stay = T / 2 - rise;
    return J * rise * (rise * rise / 6 + rise * stay / 2 + stay * stay / 2);
  }

  void set_speed(std::size_t k, double tolerance) {
    Vertex& vertex = vertices_[k];
    const Vertex& before = at(k + count() - 1);
    vertex.turn = (vertex.direction - before.direction).norm();
    if (vertex.turn < kStraight) vertex.turn = 0;
    const double room = std::min(vertex.length, before.length) / 2;
    if (vertex.turn == 0) {
      vertex.speed = limits_.speed;
      return;
    }
    vertex.speed = largest(0, limits_.speed, [&](double speed) {
      return cut(vertex, speed) <= tolerance && reach(vertex, speed) <= room;
    });
    if (delay(vertex, vertex.speed) > delay(vertex, 0)) vertex.speed = 0;
  }

  /// What the corner costs beside its way at full speed, s. To slow down, turn and speed up are three ramps,
  /// to stop and go on are two: where the jerk is low, a slow turn takes longer than a stop.
  double delay(const Vertex& vertex, double speed) const {
    return (1 - speed / limits_.speed) *
           (ramp_time(limits_.speed - speed, limits_) + ramp_time(speed * vertex.turn, limits_));
  }

  /// Lowers the higher of two speeds as far as the leg between them asks.
  /// @return  whether that was necessary
  bool fit(std::size_t higher, double lower_speed, double room) {
    Vertex& vertex = vertices_[higher % count()];
    const double old = vertex.speed;
    vertex.speed = largest(lower_speed, old, [&](double speed) {
      return ramp_distance(lower_speed, speed, limits_) + reach(vertex, speed) <= room;
    });
    return vertex.speed < old;
  }

  bool slow_down() {
    bool any = false;
    for (std::size_t k = 0; k < legs(); ++k) {
      const double here = at(k).speed, there = next(k).speed, length = at(k).length;
      any |= here < there ? fit(k + 1, here, length - reach(k)) : fit(k, there, length - reach(k + 1));
    }
    // A closed path begins at rest on its first leg.
    if (closed_) any |= fit(1, 0, at(0).length);
    return any;
  }

  bool closed_;
  MotionLimits limits_;
  std::vector<Vertex> vertices_;
};

SmoothPath path_with(const std::vector<rt::EffectorVector>& waypoints, bool closed, double tolerance,
                     const MotionLimits& limits) {
  const Corners corners(waypoints, closed, tolerance, limits);
  SmoothPath path{MotionProfile(waypoints.front()), std::nullopt};
  if (corners.count() < 2) return path;

  const auto leg = [&](MotionProfile& profile, std::size_t k, double from, double v0) {
    const double v1 = corners.next(k).speed;
    profile.set_label(corners.next(k).label);
    profile.straight(corners.at(k).direction, corners.at(k).length - from - corners.reach(k + 1), v0, v1,
                     limits);
  };
  const auto turn = [&](MotionProfile& profile, std::size_t k) {
    const Vertex& vertex = corners.at(k);
    profile.ramp(vertex.speed * vertex.direction, vertex.speed * vertex.turn, limits);
    profile.end_at(vertex.position + corners.reach(k) * vertex.direction);
  };

  leg(path.begin, 0, 0, 0);
  if (!closed) {
    for (std::size_t k = 1; k < corners.legs(); ++k) {
      turn(path.begin, k);
      leg(path.begin, k, corners.reach(k), corners.at(k).speed);
    }
    path.begin.end_at(waypoints.back());
    return path;
  }
  const Vertex& first = corners.at(1);
  const rt::EffectorVector& arrives = corners.at(0).direction;
  path.round.emplace(first.position - corners.reach(1) * arrives);
  path.round->ramp(first.speed * arrives, 0, limits);
  for (std::size_t k = 1; k <= corners.count(); ++k) {
    turn(*path.round, k);
    leg(*path.round, k, corners.reach(k), corners.at(k).speed);
  }
  return path;
}

}  // namespace

SmoothPath smooth_path(const std::vector<rt::EffectorVector>& waypoints, bool closed, double tolerance,
                       const MotionLimits& limits) {
  SmoothPath stopping = path_with(waypoints, closed, 0, limits);
  if (tolerance == 0) return stopping;
  // On legs too short for the full speed, curves may still take longer than stops.
  SmoothPath cutting = path_with(waypoints, closed, tolerance, limits);
  const auto duration_s = [](const SmoothPath& path) {
    return (path.round ? *path.round : path.begin).duration_s();
  };
  return duration_s(cutting) <= duration_s(stopping) ? cutting : stopping;
}

}  // namespace tendril::app
