// SPDX-License-Identifier: MIT
#include <array>
#include <new>
#include <resonid/online/control.hpp>

#include "../define_case.hpp"
#include "../record.hpp"
#include "cases.hpp"

using namespace resonid::online;

namespace {

/// PI behind two biquads with gains over position and a limit of the torque. The excitation is the reference,
/// the output of the drive the velocity, and its input stands for a position.
struct DriveControlCase {
  using Estimator = DriveControl<float, 2, 5>;
  static inline Storage<Estimator> control;
  static inline std::array<float, 64> newest;
  static inline std::size_t next;

  static bool create() {
    constexpr std::array<Biquad, 2> kBiquads{{{40.0, 0.2, 0.6}, {70.0, 0.9, 0.5}}};
    constexpr std::array<GainNode, 5> kNodes{
        {{-2.0, 0.5, 4.0}, {-1.0, 0.7, 6.0}, {0.0, 1.0, 8.0}, {1.0, 0.8, 6.0}, {2.0, 0.6, 4.0}}};
    DriveControlConfig config;
    config.sample_rate_hz = drive::kSampleRateHz;
    config.torque_limit = 20.0;
    config.biquads = kBiquads;
    config.schedule = kNodes;
    next = 0;
    newest = {};
    return control.hold(Estimator::create(config));
  }
  static void step(const Sample& s) {
    newest[next] = control->step({.reference = s.ru, .velocity = s.y, .position = s.u});
    next = (next + 1) % newest.size();
  }
  static void report(Output& out) { out.floats("torque", newest); }
};

/// A cascade, its position summed, while other biquads take over: both chains run in every sample.
struct DriveCascadeCase {
  using Estimator = DriveControl<float, 2, 5>;
  static inline Storage<Estimator> control;
  static inline std::array<float, 64> newest;
  static inline std::size_t next;

  static bool create() {
    constexpr std::array<Biquad, 2> kOld{{{40.0, 0.2, 0.6}, {70.0, 0.9, 0.5}}},
        kNew{{{45.0, 0.2, 0.6}, {80.0, 0.9, 0.5}}};
    DriveControlConfig config;
    config.sample_rate_hz = drive::kSampleRateHz;
    config.kp = 1.0;
    config.ki = 8.0;
    config.kv = 5.0;
    config.sums_velocity = true;
    config.torque_limit = 20.0;
    config.biquads = kOld;
    next = 0;
    newest = {};
    return control.hold(Estimator::create(config)) &&
           control->exchange_filters(kNew, 0, 1'000'000).has_value();
  }
  static void step(const Sample& s) {
    newest[next] = control->step({.reference = s.ru, .velocity = s.y, .velocity_feed_forward = s.u});
    next = (next + 1) % newest.size();
  }
  static void report(Output& out) { out.floats("torque", newest); }
};

}  // namespace

const Case drive_control = case_of<DriveControlCase>("drive_control", Injection::prbs);
const Case drive_cascade = case_of<DriveCascadeCase>("drive_cascade", Injection::prbs);
