// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/diagnostics/detail/finding_catalogue.hpp>
#include <resonid/identification/result.hpp>
#include <resonid/report/detail/typography.hpp>
#include <resonid/report/json.hpp>
#include <resonid/response/line_estimates.hpp>

#include "report/pages/page_charts.hpp"

namespace resonid::report {
namespace {

using identification::Result;
using nlohmann::json;

constexpr std::size_t kBins = 1200;  // of a signal's envelope

json curve(const data::FrequencyResponse& g, bool with_std) {
  json c{{"frequency_hz", g.frequency_hz}, {"real", json::array()}, {"imag", json::array()}};
  for (const auto& value : g.value) {
    c["real"].push_back(value.real());
    c["imag"].push_back(value.imag());
  }
  if (with_std && !g.std.empty()) c["std"] = g.std;
  return c;
}

/// Lowest and highest value per bin, so that a plot of any width shows every peak.
struct Envelope {
  std::vector<double> time_s, low, high;
};

Envelope envelope(const std::vector<double>& x, double start_s, double rate_hz) {
  Envelope e;
  const std::size_t bins = std::min(kBins, x.size());
  for (std::size_t b = 0; b < bins; ++b) {
    const std::size_t first = b * x.size() / bins;
    const std::size_t last = std::max(first + 1, (b + 1) * x.size() / bins);
    const auto [low, high] = std::minmax_element(x.begin() + static_cast<std::ptrdiff_t>(first),
                                                 x.begin() + static_cast<std::ptrdiff_t>(last));
    e.time_s.push_back(start_s + static_cast<double>(first) / rate_hz);
    e.low.push_back(*low);
    e.high.push_back(*high);
  }
  return e;
}

/// Of the part that was used: the record less its dropped periods.
json signals_json(const data::Record& record, std::size_t used) {
  json signals{{"channels", json::array()}};
  const std::size_t dropped = record.samples() - std::min(used, record.samples());
  const double start = record.start_time_s + static_cast<double>(dropped) / record.sample_rate_hz;
  const auto put = [&](const char* role, const data::Channel& channel) {
    if (!channel.present()) return;
    const std::vector<double> samples(channel.samples.begin() + static_cast<std::ptrdiff_t>(dropped),
                                      channel.samples.end());
    const auto e = envelope(samples, start, record.sample_rate_hz);
    signals["time_s"] = e.time_s;
    signals["channels"].push_back(
        {{"role", role}, {"name", channel.name}, {"unit", channel.unit}, {"min", e.low}, {"max", e.high}});
  };
  put("excitation", record.excitation);
  put("input", record.input);
  put("output", record.output);
  put("second output", record.second_output);
  return signals;
}

/// Where the dense model curve is drawn: the measured band, a little beyond it.
std::vector<double> model_grid(const data::FrequencyResponse& g, double nyquist_hz) {
  std::vector<double> grid;
  if (g.lines() == 0) return grid;
  const double low = std::max(0.7 * g.frequency_hz.front(), 1e-9);
  const double high = std::min(1.4 * g.frequency_hz.back(), 0.99 * nyquist_hz);
  constexpr int kPoints = 600;
  for (int i = 0; i < kPoints; ++i)
    grid.push_back(low * std::pow(high / low, static_cast<double>(i) / (kPoints - 1)));
  return grid;
}

json mark(const char* kind, double frequency_hz, const data::FrequencyResponse& loop) {
  const auto value = loop.at(frequency_hz);
  return {{"kind", kind}, {"frequency_hz", frequency_hz}, {"real", value.real()}, {"imag", value.imag()}};
}

void put_loop(const Result& result, json& page) {
  if (result.measured_loop) page["loop_measured"] = curve(*result.measured_loop, true);
  if (result.planned_loop) {
    page["planned_curve"] = curve(result.planned_loop->curve, false);
    for (const auto& c : result.planned_loop->crossings) {
      json crossing{
          {"frequency_hz", c.frequency_hz}, {"phase_margin_deg", c.phase_margin_deg}, {"falling", c.falling}};
      if (c.phase_margin_std_deg) crossing["phase_margin_std_deg"] = *c.phase_margin_std_deg;
      page["planned_crossings"].push_back(std::move(crossing));
    }
  }
  if (!result.loop) return;
  const auto& loop = *result.loop;
  page["loop_curve"] = curve(loop.curve, true);
  page["loop_curve"]["source"] = loop.source;
  page["loop_marks"] = json::array();
  if (loop.margins.crossover_hz())
    page["loop_marks"].push_back(mark("crossover", *loop.margins.crossover_hz(), loop.curve));
  page["loop_marks"].push_back(mark("modulus", loop.margins.modulus_margin_hz, loop.curve));
  if (loop.margins.gain_margin_hz)
    page["loop_marks"].push_back(mark("gain", *loop.margins.gain_margin_hz, loop.curve));
}

/// Noise and distortion beside the lines that they belong to, so that they are thinned with them.
void put_levels(json& data) {
  const auto distortion = data.find("distortion");
  if (distortion == data.end()) return;
  for (const char* key : {"noise_std", "distortion_std"})
    if (const auto column = distortion->find(key); column != distortion->end()) {
      data["frequency_response"][key] = std::move(*column);
      distortion->erase(column);
    }
}

}  // namespace

json page_json(const Result& result, const data::Record& record) {
  json data = to_json(result);
  json page{
      {"title", result.record.file},
      {"confidence", result.confidence},
      {"units",
       {{"input", result.units.input}, {"output", record.output.unit}, {"response", result.units.response}}},
      {"signals", signals_json(record, result.record.samples)},
      {"summary", json::array()}};
  for (const auto& text : sentences(result)) page["summary"].push_back(typeset(text));
  for (const auto& f : result.findings) page["finding_titles"][f.id] = diagnostics::finding_title(f.id);
  if (record.excitation.present()) page["units"]["excitation"] = record.excitation.unit;
  if (result.model) {
    auto model = result.model->drive.response(model_grid(result.response, 0.5 * record.sample_rate_hz));
    model.value = result.model->drive.values(model.frequency_hz, true);  // drawn as it was measured
    page["model_curve"] = curve(model, true);
    if (const auto& second = result.second_output) {
      auto model_at_load = result.model->drive;
      if (second->delay_s) model_at_load.delay_s += second->delay_s->value;
      model.value = fit::load_values(model_at_load, second->kind, model.frequency_hz);
      for (auto& value : model.value) value *= second->gain ? second->gain->value : 1.0;
      page["load_curve"] = curve(model, false);
    }
  }
  if (result.black_box && !result.model)
    page["model_curve"] = curve(
        response::to_velocity(
            result.black_box->model.response(model_grid(
                result.response, std::min(0.5 * record.sample_rate_hz,
                                          0.5 / result.black_box->model.transfer_function.sample_time_s))),
            record.output_quantity, record.sample_time_s()),
        true);
  put_loop(result, page);
  if (!result.residual.empty()) {
    const double start =
        record.start_time_s +
        static_cast<double>(record.samples() - result.residual.size()) / record.sample_rate_hz;
    const auto e = envelope(result.residual, start, record.sample_rate_hz);
    page["residual"] = {{"time_s", e.time_s}, {"min", e.low}, {"max", e.high}, {"unit", record.output.unit}};
  }
  put_charts(result, record, page);
  put_levels(data);
  data["page"] = std::move(page);
  return data;
}

}  // namespace resonid::report
