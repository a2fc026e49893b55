// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <identification/track_discrete.hpp>
#include <identification/track_plan.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/online/lines/kalman_bank.hpp>
#include <resonid/online/lines/response_tracker.hpp>
#include <resonid/online/lines/sliding_dft.hpp>
#include <resonid/online/models/detail/response_fit.hpp>
#include <resonid/response/line_estimates.hpp>
#include <resonid/response/periodic_averaging.hpp>

namespace resonid::identification::detail {
namespace {

using Complex = std::complex<double>;
constexpr std::size_t kMostLines = 256;
constexpr std::size_t kMostWindow = 16384;
constexpr double kMostUncertainLine = 0.2;

tl::unexpected<Error> refused(const Error& error, const char* field) {
  return tl::unexpected(Error{
      field, fmt::format("{} {} (found {:.6g})", error.field.view(), error.requirement.view(), error.value)});
}

/// Trackers of fixed lines on ru, u and y, and the rational model of order 3 that fits the lines of each row.
template <class Tracker>
class FixedLines final : public OnlineTracker {
 public:
  using Fit = online::ResponseFit<double, 3, kMostLines>;

  FixedLines(const online::ResponseTracker<Tracker>& lines, Approach approach, data::OutputQuantity quantity,
             double sample_rate_hz)
      : lines_(lines), approach_(approach), sample_rate_hz_(sample_rate_hz) {
    for (std::size_t i = 0; i < lines_.lines(); ++i) {
      now_.frequency_hz.push_back(lines_.frequency_hz(i));
      factor_.push_back(response::velocity_factor(quantity, lines_.frequency_hz(i), 1.0 / sample_rate_hz));
    }
    now_.value.resize(lines_.lines());
    now_.std.resize(lines_.lines());
    online::ResponseFitConfig config;
    config.sample_rate_hz = sample_rate_hz;
    config.frequency_hz = now_.frequency_hz;
    if (auto fit = Fit::create(config)) fit_ = std::make_unique<Fit>(*fit);
  }

  void step(double ru, double u, double y) noexcept override {
    lines_.step(ru, u, y);
    fresh_ = false;
  }
  [[nodiscard]] std::vector<OnlineColumn> columns() const override {
    std::vector<OnlineColumn> columns;
    for (const double f : now_.frequency_hz)
      for (const char* part : {"re", "im", "std"})
        columns.push_back({fmt::format("{}_{:g}", part, f), "", false, true});
    return columns;
  }
  void read(std::span<OnlineValue> values) override {
    refresh();
    for (std::size_t i = 0; i < now_.lines(); ++i) {
      if (!lines_.settled(i)) continue;
      values[3 * i].value = now_.value[i].real();
      values[3 * i + 1].value = now_.value[i].imag();
      if (std::isfinite(now_.std[i])) values[3 * i + 2].value = now_.std[i];
    }
  }
  [[nodiscard]] bool ready() const override { return lines_.ready(); }
  /// Of the lines, and what the machine's own oscillation adds to a change.
  [[nodiscard]] double lag_samples() const override {
    double sum = 0.0;
    for (std::size_t i = 0; i < lines_.lines(); ++i) sum += lines_.lag_samples(i);
    return sum / static_cast<double>(lines_.lines()) + (has_model() ? fit_->lag_samples() : 0.0);
  }
  [[nodiscard]] OnlineValue resonance() override {
    refresh();
    return has_model() ? figures_.resonance : OnlineValue{};
  }
  [[nodiscard]] OnlineValue antiresonance() override {
    refresh();
    return has_model() ? figures_.antiresonance : OnlineValue{};
  }
  [[nodiscard]] bool finds_resonance() const override { return has_model(); }
  /// Of the resonance, or of the median line where no model fits.
  [[nodiscard]] double uncertainty() override {
    refresh();
    if (has_model()) return figures_.resonance.deviation / figures_.resonance.value;
    std::vector<double> relative;
    for (std::size_t i = 0; i < now_.lines(); ++i) relative.push_back(now_.std[i] / std::abs(now_.value[i]));
    std::erase_if(relative, [](double r) { return std::isnan(r); });
    if (relative.empty()) return kUnknown;
    const auto middle = relative.begin() + static_cast<std::ptrdiff_t>(relative.size() / 2);
    std::nth_element(relative.begin(), middle, relative.end());
    return *middle;
  }
  [[nodiscard]] double most_uncertainty() const override {
    return has_model() ? OnlineTracker::most_uncertainty() : kMostUncertainLine;
  }
  [[nodiscard]] bool answers_anywhere() const override { return has_model(); }
  [[nodiscard]] std::span<const double> own_frequencies_hz() const override { return now_.frequency_hz; }
  void response(std::span<const double> frequency_hz, std::span<Complex> values) override {
    refresh();
    if (!has_model()) {
      std::copy(now_.value.begin(), now_.value.end(), values.begin());
      return;
    }
    const auto model = fit_->model();
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = online::response(model, frequency_hz[i], sample_rate_hz_);
  }

 private:
  /// A fit without a resonance, or an unstable one, is none.
  [[nodiscard]] bool has_model() const {
    return fit_ && ready() && fit_->ready() && figures_.physical && std::isfinite(figures_.resonance.value);
  }
  void refresh() {
    if (fresh_) return;
    bool known = true;
    for (std::size_t i = 0; i < now_.lines(); ++i) {
      now_.value[i] = factor_[i] * Complex(lines_.response(i, approach_));
      now_.std[i] = std::abs(factor_[i]) * lines_.standard_deviation(i);
      known = known && std::isfinite(now_.std[i]);
    }
    fresh_ = true;
    if (!fit_ || !ready()) return;
    fit_->step(now_.value, known ? std::span<const double>(now_.std) : std::span<const double>());
    if (fit_->ready())
      figures_ = figures_of(online::DiscreteModel<double, 3>(fit_->model()),
                            online::ModelCovariance<double, 3>(fit_->covariance()), sample_rate_hz_);
  }

  online::ResponseTracker<Tracker> lines_;
  Approach approach_;
  double sample_rate_hz_;
  std::vector<Complex> factor_;
  data::FrequencyResponse now_;
  std::unique_ptr<Fit> fit_;  // none for too few lines
  DiscreteFigures<3> figures_;
  bool fresh_ = false;
};

/// Lines to track: those given, else those that the excitation's period shows.
expected<std::vector<double>, Error> lines_of(const data::Record& record, const TrackPlan& plan,
                                              const TrackOptions& options) {
  if (!plan.measurement.grid_hz.empty()) return plan.measurement.grid_hz;
  const std::size_t period = plan.measurement.period_samples;
  if (period == 0) return tl::unexpected(Error{"lines_hz", "must be given: the excitation shows no period"});
  response::PeriodicConfig config;
  config.period_samples = period;
  if (options.common.band_hz) {
    config.band_low_hz = plan.measurement.low_hz;
    config.band_high_hz = plan.measurement.high_hz;
  }
  const auto found = response::periodic_lines(record, config, plan.approach);
  if (!found) return refused(found.error(), "lines");
  std::vector<double> lines;
  for (const auto& line : found->lines) lines.push_back(line.frequency_hz);
  if (lines.empty()) return tl::unexpected(Error{"lines_hz", "must be given: the excitation shows none"});
  if (lines.size() > kMostLines)
    return tl::unexpected(
        Error{"lines_hz", fmt::format("must be given: the excitation has {} lines, {} at most can be tracked",
                                      lines.size(), kMostLines)});
  return lines;
}

template <class Tracker>
TrackerMade made(const Tracker& pattern, const data::Record& record, const TrackOptions& options,
                 const TrackPlan& plan, std::vector<double> lines_hz) {
  online::ResponseTrackerConfig config;
  config.known_delay_s = options.common.delay_s;
  std::vector<Complex> controller;
  if (options.common.controller) {
    // The indirect response is that of the recorded quantity, which the controller sees.
    for (const double f : lines_hz) controller.push_back(options.common.controller->response(f));
    config.controller_at_line = controller;
  }
  auto response = online::ResponseTracker<Tracker>::create(pattern, config);
  if (!response) return refused(response.error(), "method");
  return std::make_unique<FixedLines<Tracker>>(*response, plan.approach, record.output_quantity,
                                               record.sample_rate_hz);
}

template <std::size_t MaxLines>
TrackerMade make_bank(const data::Record& record, const TrackOptions& options, const TrackPlan& plan,
                      std::vector<double> lines_hz) {
  const auto& wanted = options.common.tracker;
  online::KalmanBankConfig config;
  config.sample_rate_hz = record.sample_rate_hz;
  config.frequency_hz = lines_hz;
  config.offset = wanted.offset;
  if (wanted.lambda) {
    config.lambda = *wanted.lambda;
  } else {
    double distance_hz = wanted.offset ? lines_hz.front() : record.sample_rate_hz;
    for (std::size_t i = 1; i < lines_hz.size(); ++i)
      distance_hz = std::min(distance_hz, lines_hz[i] - lines_hz[i - 1]);
    config.gain = online::GainRule::placed_poles;
    config.pole_radius = wanted.pole_radius.value_or(
        options.memory_s > 0.0 ? std::exp(-1.0 / (options.memory_s * record.sample_rate_hz))
                               : std::clamp(1.0 - 1.5 * distance_hz / record.sample_rate_hz, 0.5, 0.9999));
  }
  auto bank = online::KalmanBank<double, MaxLines>::create(config);
  if (!bank) return refused(bank.error(), bank.error().field == "pole_radius" ? "pole_radius" : "lines_hz");
  return made(*bank, record, options, plan, std::move(lines_hz));
}

TrackerMade make_sliding(const data::Record& record, const TrackOptions& options, const TrackPlan& plan,
                         std::vector<double> lines_hz) {
  const std::size_t period = plan.measurement.period_samples;
  auto window = static_cast<std::size_t>(std::llround(options.memory_s * record.sample_rate_hz));
  // Two periods unless told otherwise: no line then stands beside another one, and a Hann window takes out
  // what a machine that changes spreads between them.
  if (period > 0)
    window = window == 0 ? 2 * period : std::max<std::size_t>(1, (window + period / 2) / period) * period;
  if (window == 0)
    return tl::unexpected(
        Error{"memory_s", "must be given: the excitation shows no period to be the window"});
  online::SlidingDftConfig config;
  config.sample_rate_hz = record.sample_rate_hz;
  config.window_samples = window;
  config.frequency_hz = lines_hz;
  if (period > 0 && window >= 2 * period) config.window = online::DftWindow::hann;
  auto dft = online::SlidingDft<double, kMostLines, kMostWindow>::create(config);
  if (!dft) return refused(dft.error(), dft.error().field == "window_samples" ? "memory_s" : "lines_hz");
  return made(*dft, record, options, plan, std::move(lines_hz));
}

}  // namespace

TrackerMade make_line_tracker(const data::Record& record, const TrackOptions& options,
                              const TrackPlan& plan) {
  auto lines = lines_of(record, plan, options);
  if (!lines) return tl::unexpected(lines.error());
  if (plan.method == TrackMethod::sliding_dft) return make_sliding(record, options, plan, std::move(*lines));
  if (lines->size() <= 32) return make_bank<32>(record, options, plan, std::move(*lines));
  return make_bank<kMostLines>(record, options, plan, std::move(*lines));
}

}  // namespace resonid::identification::detail
