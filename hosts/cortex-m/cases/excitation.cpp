// SPDX-License-Identifier: MIT
#include <array>
#include <new>
#include <resonid/online/excitation/chirp.hpp>
#include <resonid/online/excitation/multisine.hpp>
#include <resonid/online/excitation/prbs.hpp>
#include <resonid/online/excitation/stepped_sine.hpp>
#include <resonid/online/supervision/change_detection.hpp>

#include "../define_case.hpp"
#include "../record.hpp"
#include "cases.hpp"

using namespace resonid::online;

namespace {

/// A generator that a static function `make` configures; the record is not used.
template <class Generator, auto Make>
struct GeneratorCase {
  using Estimator = Generator;
  static inline Storage<Generator> generator;
  static inline std::array<float, 64> newest;
  static inline std::size_t next;

  static bool create() {
    next = 0;
    return generator.hold(Make());
  }
  static void step(const Sample&) {
    newest[next] = static_cast<float>(generator->step());
    next = (next + 1) % newest.size();
  }
  static void report(Output& out) { out.floats("newest", newest); }
};

constexpr std::array<double, 21> lines() {
  std::array<double, 21> hz{};
  for (std::size_t i = 0; i < hz.size(); ++i) hz[i] = 5.0 * static_cast<double>(i + 1);
  return hz;
}
auto make_prbs() { return Prbs::create({.sample_rate_hz = drive::kSampleRateHz, .register_length = 10}); }
auto make_multisine() {
  const auto hz = lines();
  const std::array<double, 1> amplitude{1.0};
  return Multisine<21>::create(
      {.sample_rate_hz = drive::kSampleRateHz, .frequency_hz = hz, .amplitude = amplitude});
}
auto make_chirp() {
  return Chirp::create({.sample_rate_hz = drive::kSampleRateHz,
                        .from_hz = drive::kChirpFromHz,
                        .to_hz = drive::kChirpToHz,
                        .duration_s = drive::kChirpDurationS,
                        .repeat = true});
}
auto make_stepped_sine() {
  const auto hz = lines();
  return SteppedSine<21>::create({.sample_rate_hz = drive::kSampleRateHz, .frequency_hz = hz});
}

/// Watches the size of the output; blocks of 16 samples.
struct ChangeDetectorCase {
  using Estimator = resonid::online::ChangeDetector<float, 64>;
  static inline Storage<Estimator> detector;

  static bool create() {
    resonid::online::ChangeDetectorConfig c;
    c.sample_rate_hz = drive::kSampleRateHz;
    c.block_s = 16.0 / drive::kSampleRateHz;
    c.baseline_s = 32.0 * c.block_s;
    c.false_alarm_interval_s = 1e5 * c.block_s;
    return detector.hold(Estimator::create(c));
  }
  static void step(const Sample& s) { detector->step(s.y); }
  static void report(Output& out) {
    out.floats("level", std::array{static_cast<float>(detector->level())});
    out.floats("baseline", std::array{static_cast<float>(detector->baseline())});
  }
};

}  // namespace

const Case prbs_10 = case_of<GeneratorCase<Prbs, make_prbs>>("prbs_10", Injection::none);
const Case multisine_21 =
    case_of<GeneratorCase<Multisine<21>, make_multisine>>("multisine_21", Injection::none);
const Case chirp = case_of<GeneratorCase<Chirp, make_chirp>>("chirp", Injection::none);
const Case stepped_sine_21 =
    case_of<GeneratorCase<SteppedSine<21>, make_stepped_sine>>("stepped_sine_21", Injection::none);
const Case change_detector = case_of<ChangeDetectorCase>("change_detector", Injection::prbs);
