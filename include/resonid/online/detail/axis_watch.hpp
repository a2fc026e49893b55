// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <resonid/base/detail/intact.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/axis_config.hpp>
#include <resonid/online/axis_result.hpp>
#include <resonid/online/detail/one_of.hpp>
#include <resonid/online/supervision/change_detection.hpp>
#include <resonid/online/supervision/detail/controller_check.hpp>

namespace resonid::online::detail {

/// Where excitation is looked for: AxisConfig::centre_hz, or what stands for it.
[[nodiscard]] double axis_centre_hz(const AxisConfig& config) noexcept;
/// Where the controller is compared: that of the lines or of the sweep, else about the centre.
[[nodiscard]] std::array<double, 2> axis_band_hz(const AxisConfig& config) noexcept;

/// One figure of the rows, watched for a lasting change. Rows that are not trusted count as missing.
template <std::size_t Window>
class AxisChangeWatch {
 public:
  static expected<AxisChangeWatch, Error> create(const AxisConfig& c) noexcept {
    AxisChangeWatch w;
    if (!c.change_of) return w;
    ChangeDetectorConfig d = c.change;
    d.sample_rate_hz = c.sample_rate_hz / static_cast<double>(c.row_every_samples);
    const auto detector = Detector::create(d);
    if (!detector) return unexpected<Error>(detector.error());
    w.detector_ = Maybe(*detector);
    w.figure_ = *c.change_of;
    return w;
  }
  void step(const AxisRow& row, AxisResult& result) noexcept {
    auto* detector = detector_.template get_if<Detector>();
    if (detector == nullptr) return;
    const Figure f = row.trusted ? figure(row) : Figure{};
    detector->step(f.value, f.std > 0.0 ? f.std : 1.0);
    result.changed = detector->alarm();
    if (result.changed) result.change = detector->change();
  }
  void reset() noexcept {
    if (auto* detector = detector_.template get_if<Detector>()) detector->reset();
  }
  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return detector_.intact() && resonid::intact(figure_, AxisFigure::gap);
  }

 private:
  using Detector = ChangeDetector<double, Window>;
  using Maybe = OneOf<Detector>;

  [[nodiscard]] Figure figure(const AxisRow& row) const noexcept {
    switch (figure_) {
      case AxisFigure::resonance:
        return row.resonance_hz;
      case AxisFigure::antiresonance:
        return row.antiresonance_hz;
      case AxisFigure::crossover:
        return row.crossover_hz;
      case AxisFigure::phase_margin:
        return row.phase_margin_deg;
      case AxisFigure::modulus_margin:
        return row.modulus_margin;
      case AxisFigure::gap:
        return row.gap;
    }
    return {};
  }

  Maybe detector_;
  AxisFigure figure_ = AxisFigure::resonance;
};

/// An axis without it.
template <>
class AxisChangeWatch<0> {
 public:
  static expected<AxisChangeWatch, Error> create(const AxisConfig& c) noexcept {
    if (c.change_of)
      return refuse("change_of", "must be empty: this axis was built without change detection");
    return AxisChangeWatch{};
  }
  void step(const AxisRow&, AxisResult&) noexcept {}
  void reset() noexcept {}
  [[nodiscard]] bool intact() const noexcept { return true; }
};

/// Whether excitation, torque and output show the controller that was told: of a velocity, with a controller
/// up to order 6 and an excitation that is in the samples.
template <class Real, bool On>
class AxisControllerCheck {
 public:
  static expected<AxisControllerCheck, Error> create(const AxisConfig& c) noexcept {
    AxisControllerCheck check;
    constexpr std::size_t kMost = ControllerCheck<Real>::kMaxOrder + 1;
    const bool possible = !c.controller_numerator.empty() && c.controller_numerator.size() <= kMost &&
                          c.controller_denominator.size() <= kMost && c.has_excitation &&
                          !c.controller_of_position && c.output == AxisOutput::velocity;
    if (!possible) return check;
    ControllerCheckConfig config{c.sample_rate_hz, c.controller_numerator, c.controller_denominator};
    const auto band = axis_band_hz(c);
    config.low_hz = band[0];
    config.high_hz = band[1];
    const auto made = ControllerCheck<Real>::create(config);
    if (!made) return check;  // a band too narrow to tell: it says nothing
    check.check_ = OneOf<ControllerCheck<Real>>(*made);
    return check;
  }
  void step(Real ru, Real u, Real y) noexcept {
    if (auto* check = check_.template get_if<ControllerCheck<Real>>()) check->step(ru, u, y);
  }
  void miss(std::uint64_t count) noexcept {
    if (auto* check = check_.template get_if<ControllerCheck<Real>>()) check->miss(count);
  }
  void reset() noexcept {
    if (auto* check = check_.template get_if<ControllerCheck<Real>>()) check->reset();
  }
  void read(AxisRow& row) const noexcept {
    const auto* check = check_.template get_if<ControllerCheck<Real>>();
    if (check == nullptr) return;
    row.controller_differs = check->differs();
    if (check->ready()) row.controller_difference = static_cast<double>(check->difference());
  }
  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept { return check_.intact(); }

 private:
  OneOf<ControllerCheck<Real>> check_;
};

/// An axis without it.
template <class Real>
class AxisControllerCheck<Real, false> {
 public:
  static expected<AxisControllerCheck, Error> create(const AxisConfig&) noexcept {
    return AxisControllerCheck{};
  }
  void step(Real, Real, Real) noexcept {}
  void miss(std::uint64_t) noexcept {}
  void reset() noexcept {}
  void read(AxisRow&) const noexcept {}
  [[nodiscard]] bool intact() const noexcept { return true; }
};

}  // namespace resonid::online::detail
