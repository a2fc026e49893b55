// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <complex>
#include <cstddef>
#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/online/axis_config.hpp>
#include <resonid/online/axis_result.hpp>
#include <resonid/online/supervision/change_detection.hpp>

namespace resonid::online::detail {

/// One figure of the rows, watched for a lasting change. Rows that are not trusted count as missing.
template <std::size_t Window>
class AxisChangeWatch {
 public:
  static expected<AxisChangeWatch, Error> create(const AxisConfig& c) noexcept {
    AxisChangeWatch w;
    if (!c.change_of) return w;
    ChangeDetectorConfig d = c.change;
    d.sample_rate_hz = c.sample_rate_hz / static_cast<double>(c.row_every_samples);
    const auto detector = ChangeDetector<double, Window>::create(d);
    if (!detector) return unexpected<Error>(detector.error());
    w.detector_ = *detector;
    w.figure_ = *c.change_of;
    return w;
  }
  void step(const AxisRow& row, AxisResult& result) noexcept {
    if (!detector_) return;
    const Figure f = row.trusted ? figure(row) : Figure{};
    detector_->step(f.value, f.std > 0.0 ? f.std : 1.0);
    result.changed = detector_->alarm();
    if (result.changed) result.change = detector_->change();
  }
  void reset() noexcept {
    if (detector_) detector_->reset();
  }

 private:
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
  std::optional<ChangeDetector<double, Window>> detector_;
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
};

/// Whether excitation, torque and output show the controller that was told.
template <bool On>
class AxisControllerCheck {
 public:
  static expected<AxisControllerCheck, Error> create(const AxisConfig&) noexcept {
    return AxisControllerCheck{};
  }
  template <class Real>
  void step(Real, Real, Real) noexcept {}
  void miss(std::uint64_t) noexcept {}
  void reset() noexcept {}
  void read(AxisRow&) const noexcept {}
};

}  // namespace resonid::online::detail
