// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <resonid/base/enum_names.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/excitation/chirp.hpp>
#include <resonid/online/excitation/detail/detection_lines.hpp>
#include <resonid/online/excitation/metrics.hpp>
#include <resonid/online/excitation/multisine.hpp>
#include <resonid/online/excitation/prbs.hpp>
#include <resonid/online/excitation/stepped_sine.hpp>
#include <span>
#include <string_view>
#include <variant>

namespace resonid::online {

inline constexpr std::size_t kMaxLines = 512;  ///< Lines of an excitation from a file or a command line.

enum class Kind { none, prbs, multisine, chirp, stepped_sine };
inline constexpr EnumName<Kind> kKindNames[] = {{Kind::none, "none"},
                                                {Kind::prbs, "prbs"},
                                                {Kind::multisine, "multisine"},
                                                {Kind::chirp, "chirp"},
                                                {Kind::stepped_sine, "stepped-sine"}};
[[nodiscard]] constexpr std::span<const EnumName<Kind>> enum_names(Kind) noexcept { return kKindNames; }

/// A number per line, most often its frequency in Hz, in a fixed room, so that a configuration needs no heap.
struct LineList {
  std::array<double, kMaxLines> value{};
  std::size_t count = 0;

  [[nodiscard]] std::span<const double> hz() const noexcept { return values(); }
  [[nodiscard]] std::span<const double> values() const noexcept { return {value.data(), count}; }
  /// False, and nothing changed, when there are too many.
  bool assign(std::span<const double> hz) noexcept;
};

/// An excitation as a file or a command line describes it. `kind` decides which of the other fields count.
struct ExcitationConfig {
  Kind kind = Kind::none;
  double amplitude = 1.0;
  std::uint64_t register_length = 10;
  std::uint64_t clock_divider = 1;
  LineList lines_hz;
  LineList line_amplitudes;
  Phases phases = Phases::schroeder;
  LineList phases_rad;
  std::uint64_t seed = 1;
  std::uint64_t periods_per_realisation = 0;
  DetectionLines detection_lines = DetectionLines::nothing;
  std::uint64_t group = 4;
  double from_hz = 0.0;
  double to_hz = 0.0;
  double duration_s = 0.0;
  Sweep sweep = Sweep::linear;
  bool repeat = false;
  double settle_periods = 5.0;
  double measure_periods = 10.0;
};

/// The fields in the order of reading; `kind` is set first and selects the rest.
template <class Visitor>
void describe(Visitor&& v, ExcitationConfig& c) {
  v("kind", c.kind, "what is injected: none, prbs, multisine, chirp or stepped-sine");
  if (c.kind == Kind::none) return;
  v("amplitude", c.amplitude, "peak value, of each line for a multisine, > 0 (Nm or N)");
  switch (c.kind) {
    case Kind::none:
      break;
    case Kind::prbs:
      v("register_length", c.register_length,
        "cells n of the shift register, 2 ... 24; the period is 2^n - 1 bits");
      v("clock_divider", c.clock_divider, "samples for which a bit is held, >= 1");
      break;
    case Kind::multisine:
      v("lines_hz", c.lines_hz, "frequencies, FIRST:LAST:STEP or a list, ascending (Hz)");
      v("line_amplitudes", c.line_amplitudes,
        "peak value of each line, as a part of amplitude, > 0; empty: 1 for all");
      v("phases", c.phases, "random, schroeder, zero, or given in phases_rad");
      v("phases_rad", c.phases_rad, "phase of each line's cosine, for phases = given only (rad)");
      v("seed", c.seed, "seed of random phases and of lines left out at random");
      v("periods_per_realisation", c.periods_per_realisation,
        "periods after which new random phases are drawn; 0: the same for ever");
      v("leave_out", c.detection_lines,
        "lines of lines_hz to leave out, to show distortion: nothing, even multiples, or odd-random: even "
        "ones and one of every group of odd ones");
      v("group", c.group, "odd lines of which odd-random leaves out one, >= 2");
      break;
    case Kind::chirp:
      v("from_hz", c.from_hz, "frequency at the start, > 0 and below half the sample rate (Hz)");
      v("to_hz", c.to_hz, "frequency at the end, likewise; lower than at the start sweeps down (Hz)");
      v("duration_s", c.duration_s, "time of one sweep, > 0 (s)");
      v("sweep", c.sweep, "linear or logarithmic");
      v("repeat", c.repeat, "begin again after the end instead of falling silent");
      break;
    case Kind::stepped_sine:
      v("lines_hz", c.lines_hz, "frequencies in the order of measuring, FIRST:LAST:STEP or a list (Hz)");
      v("settle_periods", c.settle_periods, "periods at each frequency before measuring, 0 ... 1e6");
      v("measure_periods", c.measure_periods, "periods measured at each frequency, 1 ... 1e6");
      break;
  }
}

/// The configuration of a multisine with just the lines that `leave_out` leaves, amplitudes and phases with
/// them, and `leave_out` done with; other kinds as they are.
[[nodiscard]] expected<ExcitationConfig, Error> with_kept_lines(const ExcitationConfig& config,
                                                                double sample_rate_hz);

/// Any of the generators behind one step(). A value without heap.
class Excitation {
 public:
  static expected<Excitation, Error> create(const ExcitationConfig& config, double sample_rate_hz);

  double step() noexcept;
  void reset() noexcept;
  void fill(std::span<double> out) noexcept {
    for (double& x : out) x = step();
  }

  /// Samples of one period, sweep or stepped measurement; 0 when there is no such length.
  [[nodiscard]] std::size_t natural_length_samples() const noexcept;
  /// Samples after which the signal repeats, but for phases that are drawn anew; 0 when it does not.
  [[nodiscard]] std::size_t period_samples() const noexcept;
  [[nodiscard]] Band band() const noexcept;
  using Generator = std::variant<std::monostate, Prbs, Multisine<kMaxLines>, Chirp, SteppedSine<kMaxLines>>;
  [[nodiscard]] const Generator& generator() const noexcept { return generator_; }

 private:
  explicit Excitation(const Generator& generator) noexcept : generator_(generator) {}
  Generator generator_;
};

}  // namespace resonid::online
