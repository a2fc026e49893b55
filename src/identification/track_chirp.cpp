// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <identification/track_plan.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/diagnostics/detail/response_extrema.hpp>
#include <resonid/online/lines/chirp_tracker.hpp>
#include <resonid/online/lines/response_tracker.hpp>
#include <resonid/response/line_estimates.hpp>

namespace resonid::identification::detail {
namespace {

using Complex = std::complex<double>;
using Tracker = online::ChirpTracker<double>;
constexpr double kMostUncertainLine = 0.2;

/// The response along a sweep: the value at the frequency that the chirp just passed, and the curve so far.
class Sweep final : public OnlineTracker {
 public:
  Sweep(const online::ResponseTracker<Tracker>& line, const online::SweepLaw& law, const TrackPlan& plan,
        const data::Record& record, double known_delay_s)
      : line_(line),
        law_(law),
        approach_(plan.approach),
        quantity_(record.output_quantity),
        sample_time_s_(record.sample_time_s()),
        known_delay_s_(known_delay_s) {}

  void step(double ru, double u, double y) noexcept override { line_.step(ru, u, y); }
  [[nodiscard]] std::vector<OnlineColumn> columns() const override {
    return {{"frequency_hz", "Hz", false, true},
            {"real", unit_, false, true},
            {"imag", unit_, false, true},
            {"std", unit_, false, true}};
  }
  void read(std::span<OnlineValue> values) override {
    values[0].value = described_hz();
    if (!ready()) return;
    const Complex g = value();
    values[1].value = g.real();
    values[2].value = g.imag();
    if (std::isfinite(deviation())) values[3].value = deviation();
    remember(g);
  }
  [[nodiscard]] bool ready() const override { return line_.settled(0); }
  [[nodiscard]] double lag_samples() const override { return line_.lag_samples(0); }
  [[nodiscard]] OnlineValue resonance() override { return extremum(false); }
  [[nodiscard]] OnlineValue antiresonance() override { return extremum(true); }
  [[nodiscard]] bool answers_anywhere() const override { return false; }
  [[nodiscard]] bool finds_resonance() const override { return false; }
  [[nodiscard]] double uncertainty() override { return deviation() / std::abs(value()); }
  [[nodiscard]] double most_uncertainty() const override { return kMostUncertainLine; }
  [[nodiscard]] std::span<const double> own_frequencies_hz() const override { return curve_.frequency_hz; }
  void response(std::span<const double>, std::span<Complex> values) override {
    std::copy(curve_.value.begin(), curve_.value.end(), values.begin());
  }

 private:
  /// The frequency that the estimate belongs to is that of the time that it describes.
  [[nodiscard]] double described_hz() const {
    const double newest_s = static_cast<double>(line_.samples()) * sample_time_s_ - sample_time_s_;
    return law_.frequency_hz(std::max(0.0, newest_s - lag_samples() * sample_time_s_));
  }
  [[nodiscard]] Complex value() const {
    // The tracker takes the delay out at its newest frequency.
    const double turn = kTwoPi * known_delay_s_ * (described_hz() - line_.frequency_hz(0));
    return Complex(line_.response(0, approach_)) * std::polar(1.0, turn) *
           response::velocity_factor(quantity_, described_hz(), sample_time_s_);
  }
  [[nodiscard]] double deviation() const {
    return line_.standard_deviation(0) *
           std::abs(response::velocity_factor(quantity_, described_hz(), sample_time_s_));
  }

  /// One point for every 500th of the sweep, the newest.
  void remember(Complex g) {
    constexpr double kPoints = 500.0;
    const double f = described_hz();
    if (!std::isfinite(g.real()) || !std::isfinite(g.imag())) return;
    const double width = std::abs(law_.to_hz - law_.from_hz) / kPoints;
    const bool rising = law_.to_hz > law_.from_hz;
    auto& c = curve_;
    const bool first = c.frequency_hz.empty();
    const double newest = first ? 0.0 : rising ? c.frequency_hz.back() : c.frequency_hz.front();
    if (!first && std::abs(f - newest) < width) return;
    if (!first && (f > newest) != rising) return;
    const auto at = [&](auto& v) { return rising ? v.end() : v.begin(); };
    c.frequency_hz.insert(at(c.frequency_hz), f);
    c.value.insert(at(c.value), g);
    c.std.insert(at(c.std), deviation());
    stale_ = true;
  }

  OnlineValue extremum(bool minimum) {
    if (stale_) {
      found_.fill(kUnknown);
      if (curve_.lines() >= 5)
        for (const auto& e : diagnostics::response_extrema(curve_))
          if (std::isnan(found_[e.minimum ? 0 : 1])) found_[e.minimum ? 0 : 1] = e.frequency_hz;
      stale_ = false;
    }
    return {found_[minimum ? 0 : 1], kUnknown};
  }

  online::ResponseTracker<Tracker> line_;
  online::SweepLaw law_;
  Approach approach_;
  data::OutputQuantity quantity_;
  double sample_time_s_, known_delay_s_;
  std::string unit_;
  data::FrequencyResponse curve_;                    // so far, ascending
  std::array<double, 2> found_{kUnknown, kUnknown};  // anti-resonance, resonance
  bool stale_ = false;
};

}  // namespace

TrackerMade make_chirp_tracker(const data::Record& record, const TrackOptions& options,
                               const TrackPlan& plan) {
  const auto& law = *plan.measurement.sweep;
  const auto& wanted = options.common.tracker;
  online::ChirpTrackerConfig config;
  config.sample_rate_hz = record.sample_rate_hz;
  config.from_hz = law.from_hz;
  config.to_hz = law.to_hz;
  config.duration_s = law.duration_s;
  config.sweep = law.sweep;
  config.offset = wanted.offset;
  if (wanted.lambda) {
    config.lambda = *wanted.lambda;
  } else {
    config.gain = online::GainRule::placed_poles;
    if (options.memory_s > 0.0)
      config.pole_radius = std::exp(-1.0 / (options.memory_s * record.sample_rate_hz));
    config.pole_radius = wanted.pole_radius.value_or(config.pole_radius);
  }
  const auto refused = [](const Error& error, const char* field) {
    return tl::unexpected(Error{field, fmt::format("{} {} (found {:.6g})", error.field.view(),
                                                   error.requirement.view(), error.value)});
  };
  auto tracker = Tracker::create(config);
  if (!tracker)
    return refused(tracker.error(), tracker.error().field == "pole_radius" ? "pole_radius" : "chirp");
  online::ResponseTrackerConfig response;
  response.known_delay_s = options.common.delay_s;
  if (options.common.controller) {
    response.controller_numerator = options.common.controller->numerator;
    response.controller_denominator = options.common.controller->denominator;
  }
  auto line = online::ResponseTracker<Tracker>::create(*tracker, response);
  if (!line) return refused(line.error(), "controller");
  return std::make_unique<Sweep>(*line, law, plan, record, options.common.delay_s);
}

}  // namespace resonid::identification::detail
