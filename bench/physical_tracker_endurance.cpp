// SPDX-License-Identifier: MIT
// A thousand million samples through the physical tracker, excitation off half of the time: the covariance
// stays symmetric, positive and bounded, the estimate stays near the truth and is frozen in silence. Minutes;
// usage: endurance_physical_tracker [SAMPLES].
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <resonid/online/models/physical_tracker.hpp>

namespace {

using resonid::online::PhysicalParameter;
using resonid::online::ZohTwoMass;
using Tracker = resonid::online::PhysicalTracker<double, 0>;

constexpr double kStiffness = 143.75;
constexpr std::int64_t kBlock = 200000;

struct Drive {
  ZohTwoMass<double> zoh = ZohTwoMass<double>::over({0.032, 0.032, kStiffness, 0.3, 0.0}, 94.8, 0.002);
  std::array<double, 3> x{};
  std::uint64_t state = 88172645463325252ULL;

  std::uint64_t random() {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return state;
  }
  void step(double u) {
    std::array<double, 3> next{};
    for (std::size_t i = 0; i < 3; ++i)
      next[i] = zoh.ab[i][0] * x[0] + zoh.ab[i][1] * x[1] + zoh.ab[i][2] * x[2] + zoh.ab[i][3] * u;
    x = next;
  }
};

/// Whether one block, with or without excitation, leaves a sound tracker.
bool block_is_sound(Tracker& tracker, Drive& drive, bool on) {
  const double frozen = tracker.value(PhysicalParameter::stiffness);
  for (std::int64_t k = 0; k < kBlock; ++k) {
    const double u = on ? ((drive.random() & 1U) != 0 ? 1.0 : -1.0) - 0.2 * drive.x[0] : 0.0;
    tracker.step(0.0, u, drive.x[0] + 0.2 * (static_cast<double>(drive.random() >> 11) * 0x1p-53 - 0.5));
    drive.step(u);
  }
  const auto p = tracker.log_covariance();
  bool sound = p.allFinite() && p == p.transpose() && p(2, 2) < 0.26 && tracker.excited() == on;
  for (int i = 0; i < 6; ++i) sound = sound && p(i, i) > 0.0;
  const double stiffness = tracker.value(PhysicalParameter::stiffness);
  return sound && std::abs(stiffness - (on ? kStiffness : frozen)) < 0.08 * kStiffness;
}

}  // namespace

int main(int argc, char** argv) {
  const std::int64_t samples = argc > 1 ? std::atoll(argv[1]) : 1000000000;
  resonid::online::PhysicalTrackerConfig c;
  c.sample_rate_hz = 500.0;
  c.driven_inertia.value = 0.035;
  c.load_inertia.value = 0.029;
  c.stiffness.value = 158.0;
  c.damping.value = 0.24;
  c.stiffness_drift_per_s = 0.05;
  auto tracker = Tracker::create(c).value();
  Drive drive;
  for (std::int64_t done = 0; done < samples; done += kBlock) {
    if (block_is_sound(tracker, drive, done / kBlock % 2 == 0)) continue;
    std::printf("not sound after %lld samples: stiffness %.4f\n", static_cast<long long>(done + kBlock),
                tracker.value(PhysicalParameter::stiffness));
    return EXIT_FAILURE;
  }
  std::printf("%lld samples: sound\n", static_cast<long long>(samples));
  return EXIT_SUCCESS;
}
