// SPDX-License-Identifier: MIT
#include "report/pages/page_charts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <resonid/response/detail/power_spectrum.hpp>
#include <span>

#include "report/document/chart_json.hpp"
#include "report/pages/curves.hpp"

namespace resonid::report {
namespace {

using identification::Result;
using nlohmann::json;

constexpr std::size_t kOverlayBins = 3000;

json overlay(const Result& result, const data::Record& record) {
  const auto& y = record.output.samples;
  const std::size_t count = std::min(result.residual.size(), y.size());
  const std::size_t first = std::min(result.residual_start, y.size() - count);
  const std::span<const double> measured(y.data() + first, count);
  std::vector<double> simulated(count);
  for (std::size_t k = 0; k < count; ++k) simulated[k] = measured[k] - result.residual[k];
  const double start = record.start_time_s + static_cast<double>(first) / record.sample_rate_hz;
  Chart chart;
  chart.title = "Output, measured and simulated";
  chart.x_label = "Time in s";
  chart.y_label = fmt::format("{} in {}", record.output.name, record.output.unit);
  chart.curves = {thinned("measured", measured, start, record.sample_rate_hz, kOverlayBins),
                  thinned("simulated", simulated, start, record.sample_rate_hz, kOverlayBins)};
  return chart_json(chart);
}

json sensitivity(const data::FrequencyResponse& loop, const SensitivityPeaks& peaks) {
  Curve s{"|S|", Curve::Mark::line, loop.frequency_hz, {}},
      t{"|T|", Curve::Mark::dashed, loop.frequency_hz, {}};
  const auto level = [](double x) { return 20.0 * std::log10(x); };
  for (const auto& l : loop.value) {
    s.y.push_back(-level(std::abs(1.0 + l)));
    t.y.push_back(level(std::abs(l / (1.0 + l))));
  }
  Chart chart;
  chart.title = "Sensitivity S = 1/(1+L) and complementary sensitivity T = L/(1+L)";
  chart.x_label = "Frequency in Hz";
  chart.y_label = "Magnitude in dB";
  chart.log_x = true;
  chart.curves = {std::move(s),
                  std::move(t),
                  {fmt::format("Ms = {:.3g} at {:.3g} Hz", peaks.ms, peaks.ms_hz),
                   Curve::Mark::points,
                   {peaks.ms_hz},
                   {level(peaks.ms)}},
                  {fmt::format("Mt = {:.3g} at {:.3g} Hz", peaks.mt, peaks.mt_hz),
                   Curve::Mark::points,
                   {peaks.mt_hz},
                   {level(peaks.mt)}}};
  return chart_json(chart);
}

/// Power per line of one signal, and where the response was measured.
json spectrum(const char* title, const data::Channel& channel, std::size_t dropped, const Result& result,
              double rate_hz) {
  const std::span<const double> all(channel.samples);
  Curve curve = power_curve(channel.name,
                            response::power_spectrum(all.subspan(std::min(dropped, all.size())), rate_hz));
  Chart chart;
  chart.title = title;
  chart.x_label = "Frequency in Hz";
  chart.y_label = fmt::format("Power in dB of ({})^2 per line", channel.unit);
  chart.log_x = true;
  const auto& lines = result.response.frequency_hz;
  constexpr std::size_t kMostMarked = 150;
  if (!lines.empty() && lines.size() <= kMostMarked && !curve.x.empty()) {
    Curve marked{"lines of the response", Curve::Mark::points, {}, {}};
    for (const double f : lines) {
      const auto at = std::lower_bound(curve.x.begin(), curve.x.end(), f);
      const auto i = static_cast<std::size_t>(std::min(at, curve.x.end() - 1) - curve.x.begin());
      const std::size_t nearest = i > 0 && f - curve.x[i - 1] < curve.x[i] - f ? i - 1 : i;
      marked.x.push_back(f);
      marked.y.push_back(curve.y[nearest]);
    }
    chart.curves = {std::move(curve), std::move(marked)};
  } else {
    chart.curves = {std::move(curve)};
    if (!lines.empty()) {
      Shape band;
      band.kind = Shape::Kind::rectangle;
      band.name = fmt::format("band of the response, {:.3g} ... {:.3g} Hz", lines.front(), lines.back());
      band.x = lines.front();
      band.x_end = lines.back();
      band.y = -HUGE_VAL;
      band.y_end = HUGE_VAL;
      chart.shapes = {std::move(band)};
    }
  }
  return chart_json(chart);
}

/// Load over motor, with the covariance of both.
void put_inertia_ratio(const Result& result, json& page) {
  if (!result.model || result.model->drive.structure != fit::Structure::two_mass) return;
  const auto& drive = result.model->drive;
  const double motor = drive.value(fit::kDrivenInertia), load = drive.value(fit::kLoadInertia);
  if (!(motor > 0.0) || !(load > 0.0)) return;
  const auto part = [&](fit::Parameter a, fit::Parameter b, double x, double y) {
    return drive.covariance(a, b) / (x * y);
  };
  const double variance = part(fit::kLoadInertia, fit::kLoadInertia, load, load) +
                          part(fit::kDrivenInertia, fit::kDrivenInertia, motor, motor) -
                          2.0 * part(fit::kLoadInertia, fit::kDrivenInertia, load, motor);
  page["inertia_ratio"] = {{"value", load / motor}};
  if (variance > 0.0) page["inertia_ratio"]["std"] = load / motor * std::sqrt(variance);
}

}  // namespace

std::optional<SensitivityPeaks> sensitivity_peaks(const Result& result) {
  if (!result.loop || result.loop->curve.lines() < 2 || !(result.loop->margins.modulus_margin > 0.0))
    return std::nullopt;
  SensitivityPeaks peaks;
  peaks.ms = 1.0 / result.loop->margins.modulus_margin;
  peaks.ms_hz = result.loop->margins.modulus_margin_hz;
  const auto& loop = result.loop->curve;
  for (std::size_t i = 0; i < loop.lines(); ++i) {
    const double t = std::abs(loop.value[i] / (1.0 + loop.value[i]));
    if (!(t > peaks.mt)) continue;
    peaks.mt = t;
    peaks.mt_hz = loop.frequency_hz[i];
  }
  return peaks;
}

void put_charts(const Result& result, const data::Record& record, json& page) {
  if (!result.residual.empty() && record.output.present()) page["overlay"] = overlay(result, record);
  if (const auto peaks = sensitivity_peaks(result)) {
    page["peaks"] = {{"ms", peaks->ms}, {"ms_hz", peaks->ms_hz}, {"mt", peaks->mt}, {"mt_hz", peaks->mt_hz}};
    page["sensitivity"] = sensitivity(result.loop->curve, *peaks);
  }
  const std::size_t dropped = record.samples() - std::min(result.record.samples, record.samples());
  const auto put = [&](const char* title, const data::Channel& channel) {
    if (channel.present())
      page["spectra"].push_back(spectrum(title, channel, dropped, result, record.sample_rate_hz));
  };
  put("Spectrum of the input", record.input);
  put("Spectrum of the output", record.output);
  put_inertia_ratio(result, page);
}

}  // namespace resonid::report
