// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/judge/loop.hpp>
#include <identification/identify/judge/without_structure.hpp>
#include <resonid/base/constants.hpp>

namespace resonid::identification::detail {
namespace {

using Complex = std::complex<double>;
using diagnostics::LoopMargins;

/// Logarithmic grid, dense enough that a chord of the Nyquist curve is as good as the curve.
std::vector<double> dense_grid(double low_hz, double high_hz) {
  constexpr int kPoints = 1500;
  std::vector<double> grid;
  grid.reserve(kPoints);
  for (int i = 0; i < kPoints; ++i)
    grid.push_back(low_hz * std::pow(high_hz / low_hz, static_cast<double>(i) / (kPoints - 1)));
  return grid;
}

class Loop {
 public:
  Loop(const Options& options, const data::FrequencyResponse& controller, const data::OutputHold& hold,
       double sample_time_s)
      : options_(options), controller_(controller), hold_(hold), sample_time_s_(sample_time_s) {}

  [[nodiscard]] data::FrequencyResponse curve(const fit::DriveModel& drive,
                                              const std::vector<double>& grid) const {
    // A fraction of a sample of the delay is seen through the hold, which is more than a turn.
    auto loop = drive.response(grid);
    auto delayed = drive;
    delayed.known_delay_s = options_.delay_s;
    return weighted(
        std::move(loop), [&](const std::vector<double>& hz) { return delayed.values(hz, true); },
        options_.delay_s);
  }
  [[nodiscard]] data::FrequencyResponse curve(const fit::BlackBoxModel& model,
                                              const std::vector<double>& grid) const {
    return weighted(
        model.response(grid), [&](const std::vector<double>& hz) { return model.response(hz).value; },
        model.known_delay_s);
  }

  [[nodiscard]] Complex controller_at(double f) const {
    return options_.controller ? options_.controller->response(f) : controller_.at(f);
  }
  /// Controller and hold of the measured output.
  [[nodiscard]] Complex feedback_at(double f) const {
    return controller_at(f) * hold_.response(f, sample_time_s_);
  }

 private:
  /// The machine's response to the loop's: `plant` gives values at any lines. A held output samples the loop
  /// anew: at the rate of its new values the images of all multiples of that rate add up.
  template <class Plant>
  [[nodiscard]] data::FrequencyResponse weighted(data::FrequencyResponse loop, Plant&& plant,
                                                 double delay_s) const {
    const double rate_hz = 1.0 / sample_time_s_;
    for (std::size_t i = 0; i < loop.lines(); ++i) {
      loop.std[i] *= std::abs(feedback_at(loop.frequency_hz[i]));
      loop.value[i] = 0.0;
    }
    for (std::size_t image = 0; image < hold_.samples; ++image) {
      const double shift_hz = rate_hz * static_cast<double>(image) / static_cast<double>(hold_.samples);
      std::vector<double> hz;
      for (const double f : loop.frequency_hz) hz.push_back(std::min(f + shift_hz, rate_hz - f - shift_hz));
      const auto values = plant(hz);
      for (std::size_t i = 0; i < hz.size(); ++i) {
        const Complex value = values[i] * feedback_at(hz[i]) * std::polar(1.0, -kTwoPi * hz[i] * delay_s);
        loop.value[i] += loop.frequency_hz[i] + shift_hz > 0.5 * rate_hz ? std::conj(value) : value;
      }
    }
    return loop;
  }

  const Options& options_;
  const data::FrequencyResponse& controller_;
  const data::OutputHold& hold_;
  double sample_time_s_;
};

/// Without what makes standard deviations, which moved models need not have.
fit::DriveModel plain(fit::DriveModel model) {
  model.estimated.fill(false);
  return model;
}
fit::BlackBoxModel plain(fit::BlackBoxModel model) {
  model.realisation.covariance.resize(0, 0);
  return model;
}

/// At half the rate of its samples a loop is real: it may end at -180 degrees without crossing them.
LoopMargins margins_of(const data::FrequencyResponse& curve, bool to_half_the_rate) {
  auto margins = diagnostics::loop_margins(curve);
  const double end = curve.value.back().real();
  if (!to_half_the_rate || end >= 0.0) return margins;
  const double db = -20.0 * std::log10(-end);
  if (db > 0.0 && !(margins.gain_margin_db && db >= *margins.gain_margin_db)) {
    margins.gain_margin_db = db;
    margins.gain_margin_hz = curve.frequency_hz.back();
  }
  return margins;
}

template <class Model>
LoopResult from_model(const Loop& loop, const std::vector<double>& grid, bool to_half_the_rate,
                      const Model& model) {
  LoopResult result;
  result.source = "model";
  result.curve = loop.curve(model, grid);
  result.margins = margins_of(result.curve, to_half_the_rate);
  const auto deviation = [&](auto&& part) {
    return model.standard_deviation_of(
        [&](const Model& m) { return part(margins_of(loop.curve(plain(m), grid), to_half_the_rate)); });
  };
  if (result.margins.crossover_hz()) {
    result.crossover_std_hz = deviation([](const LoopMargins& l) { return l.crossover_hz().value_or(0.0); });
    result.phase_margin_std_deg =
        deviation([](const LoopMargins& l) { return l.phase_margin_deg().value_or(0.0); });
  }
  if (result.margins.gain_margin_db)
    result.gain_margin_std_db =
        deviation([](const LoopMargins& l) { return l.gain_margin_db.value_or(0.0); });
  result.modulus_margin_std = deviation([](const LoopMargins& l) { return l.modulus_margin; });
  return result;
}

/// The lines that are known better than 30 %: margins of noise are none.
data::FrequencyResponse well_known(const data::FrequencyResponse& g) {
  if (g.std.size() != g.lines()) return g;
  data::FrequencyResponse known;
  for (std::size_t i = 0; i < g.lines(); ++i) {
    if (!(g.std[i] < kCriteria.margin_line * std::abs(g.value[i]))) continue;
    known.frequency_hz.push_back(g.frequency_hz[i]);
    known.value.push_back(g.value[i]);
    known.std.push_back(g.std[i]);
    if (g.coherence.size() == g.lines()) known.coherence.push_back(g.coherence[i]);
  }
  return known;
}

/// Whether enough lines are left to interpolate between.
bool enough(const data::FrequencyResponse& known, std::size_t lines) {
  constexpr std::size_t kLeast = 2, kShare = 4;
  return known.lines() >= std::max(kLeast, lines / kShare);
}

LoopResult from_response(const data::FrequencyResponse& curve) {
  LoopResult result;
  result.source = "response";
  result.curve = curve;
  result.margins = diagnostics::loop_margins(curve);
  return result;
}

}  // namespace

std::optional<diagnostics::Finding> keep_to_band(const Plan& plan, bool controller_from_record,
                                                 LoopResult& loop) {
  const double lowest_hz = plan.low_hz / kCriteria.beyond_band,
               highest_hz = kCriteria.beyond_band * plan.high_hz;
  const auto crossover = loop.margins.crossover_hz();
  if (controller_from_record && crossover && !(*crossover > lowest_hz && *crossover < highest_hz)) {
    loop.crossover_std_hz = loop.phase_margin_std_deg = loop.modulus_margin_std =
        loop.gain_margin_std_db = {};
    return diagnostics::Finding{
        "crossover-outside-band", diagnostics::Severity::warning, *crossover, plan.low_hz,
        fmt::format("The loop crosses over at {:.3g} Hz, far outside the excited band of {:.3g} ... {:.3g} "
                    "Hz: the identified controller is extrapolated there, and the margins have no error "
                    "bars. Give .controller.",
                    *crossover, plan.low_hz, plan.high_hz)};
  }
  if (loop.source != "model") return std::nullopt;
  std::vector<std::string> beyond;
  double furthest_hz = 0.0;
  const auto withhold = [&](const char* name, std::optional<double> hz, std::optional<double>& std) {
    if (!std || !hz || !(*hz > highest_hz)) return;
    beyond.push_back(fmt::format("{} ({:.3g} Hz)", name, *hz));
    furthest_hz = std::max(furthest_hz, *hz);
    std.reset();
  };
  withhold("crossover", crossover, loop.crossover_std_hz);
  withhold("phase margin", crossover, loop.phase_margin_std_deg);
  withhold("modulus margin", loop.margins.modulus_margin_hz, loop.modulus_margin_std);
  withhold("gain margin", loop.margins.gain_margin_hz, loop.gain_margin_std_db);
  if (beyond.empty()) return std::nullopt;
  return diagnostics::Finding{
      "margins-beyond-band", diagnostics::Severity::info, furthest_hz, plan.high_hz,
      fmt::format("Beyond the excited band of {:.3g} ... {:.3g} Hz the model alone tells the {}: a mode that "
                  "the recording does not show would change them, and they have no error bars. Excite up to "
                  "{:.3g} Hz.",
                  plan.low_hz, plan.high_hz, fmt::join(beyond, ", "), furthest_hz)};
}

void include_controller(
    const fit::ControllerEstimate& shown,
    const std::function<std::optional<LoopResult>(const data::TransferFunction&)>& loop_with,
    LoopResult& loop) {
  if (!shown.model) return;
  const auto figures = [](const LoopMargins& m) -> Eigen::Vector4d {
    return {m.crossover_hz().value_or(0.0), m.phase_margin_deg().value_or(0.0), m.modulus_margin,
            m.gain_margin_db.value_or(0.0)};
  };
  // Of [b0, b1, ..., a1, a2, ...]; what an integrator fixes has no deviation.
  const auto& c = shown.model->covariance;
  const auto zeros = static_cast<Eigen::Index>(shown.controller.numerator.size());
  Eigen::MatrixXd gradient = Eigen::MatrixXd::Zero(4, c.rows());
  for (Eigen::Index i = 0; i < c.rows(); ++i) {
    constexpr double kSmall = 0.01;  // of the standard deviation
    const double by = kSmall * std::sqrt(std::max(0.0, c(i, i)));
    if (!(by > 0.0)) continue;
    const auto margins = [&](double step) {
      auto moved = shown.controller;
      (i < zeros ? moved.numerator[static_cast<std::size_t>(i)]
                 : moved.denominator[static_cast<std::size_t>(i - zeros + 1)]) += step;
      const auto other = loop_with(moved);
      return other ? figures(other->margins) : figures(loop.margins);
    };
    gradient.col(i) = (margins(by) - margins(-by)) / (2.0 * by);
  }
  const Eigen::Vector4d variance = (gradient * c * gradient.transpose()).diagonal().cwiseMax(0.0);
  std::optional<double>* const stds[] = {&loop.crossover_std_hz, &loop.phase_margin_std_deg,
                                         &loop.modulus_margin_std, &loop.gain_margin_std_db};
  for (Eigen::Index i = 0; i < 4; ++i)
    if (auto& std = *stds[i]) std = std::sqrt(*std * *std + variance(i));
}

PlantModel plain(PlantModel model) {
  if (auto* drive = std::get_if<fit::DriveModel>(&model)) return plain(std::move(*drive));
  if (auto* box = std::get_if<fit::BlackBoxModel>(&model)) return plain(std::move(*box));
  return model;
}

PlantModel plant_model(const Result& result) {
  if (result.model) return result.model->drive;
  if (result.black_box) return result.black_box->model;
  return {};
}

std::optional<LoopResult> loop_of(const Plan& plan, const Options& options,
                                  const response::LineEstimates& lines,
                                  const data::FrequencyResponse& response, const PlantModel& model) {
  data::FrequencyResponse controller;
  if (!options.controller) {
    auto measured = response::controller_response(lines);
    if (!measured) return std::nullopt;
    if (lines.output_quantity !=
        data::OutputQuantity::velocity) {  // the controller sees the recorded quantity
      const auto loop = response::loop_response(lines);
      if (!loop || !enough(well_known(*loop), loop->lines())) return std::nullopt;
      return from_response(well_known(*loop));
    }
    controller = well_known(*measured);
    if (!enough(controller, measured->lines())) return std::nullopt;
  }
  const Loop loop(options, controller, plan.hold, lines.sample_time_s);
  if (!std::holds_alternative<std::monostate>(model)) {
    const double nyquist = 0.5 / lines.sample_time_s;
    const double low =
        options.controller ? std::min(0.1 * plan.low_hz, 0.01 * nyquist) : controller.frequency_hz.front();
    // Of a held output's new values.
    const double highest = nyquist / static_cast<double>(plan.hold.samples);
    double high = std::min(highest, options.controller ? nyquist : controller.frequency_hz.back());
    // A black box of a band has a rate of its own, about which its response would repeat.
    if (const auto* box = std::get_if<fit::BlackBoxModel>(&model);
        box != nullptr && box->transfer_function.sample_time_s > 1.5 * lines.sample_time_s)
      high = std::min(high, reach_hz(*box));
    const auto grid = dense_grid(std::max(low, 1e-6 * nyquist), high);
    if (const auto* drive = std::get_if<fit::DriveModel>(&model))
      return from_model(loop, grid, high == highest, *drive);
    return from_model(loop, grid, high == highest, std::get<fit::BlackBoxModel>(model));
  }
  if (!options.controller) {
    const auto measured = response::loop_response(lines);
    if (!measured || !enough(well_known(*measured), measured->lines())) return std::nullopt;
    return from_response(well_known(*measured));
  }
  auto curve = response;
  for (std::size_t i = 0; i < curve.lines(); ++i) {
    const double f = curve.frequency_hz[i];
    const Complex factor = loop.feedback_at(f) * std::polar(1.0, -kTwoPi * f * options.delay_s);
    curve.value[i] *= factor;
    if (!curve.std.empty()) curve.std[i] *= std::abs(factor);
  }
  return from_response(curve);
}

}  // namespace resonid::identification::detail
