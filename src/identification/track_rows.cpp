// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <identification/track_rows.hpp>

namespace resonid::identification::detail {
namespace {

constexpr std::array<const char*, 3> kMargins = {"crossover_hz", "phase_margin_deg", "modulus_margin"};
constexpr std::array<const char*, 3> kMarginUnits = {"Hz", "deg", ""};

}  // namespace

Rows::Rows(const data::Record& record, const TrackOptions& options, std::vector<OnlineColumn> columns,
           const LoopFigures& loop, std::size_t expected_rows, Track& track)
    : options_(options),
      columns_(std::move(columns)),
      has_loop_(loop.has_loop()),
      has_gap_(loop.has_gap()),
      has_position_(record.position.present()),
      track_(track) {
  if (options.kept_rows > 0)
    stride_ = std::max<std::size_t>(1, (expected_rows + options.kept_rows - 1) / options.kept_rows);
  for (const auto& column : columns_)
    (column.line ? track.lines : track.parameters).push_back({column.name, column.unit, {}, {}});
  track.figures = {{"resonance_hz", "Hz", {}, {}}, {"antiresonance_hz", "Hz", {}, {}}};
  if (has_loop_)
    for (std::size_t i = 0; i < kMargins.size(); ++i)
      track.figures.push_back({kMargins[i], kMarginUnits[i], {}, {}});
  if (has_gap_) track.figures.push_back({"gap", "", {}, {}});
  if (options.on_columns) options.on_columns(names());
}

std::vector<std::string> Rows::names() const {
  std::vector<std::string> names{"time_s"};
  for (const auto& column : columns_) {
    names.push_back(column.name);
    if (column.deviation) names.push_back(column.name + "_std");
  }
  for (const char* figure : {"resonance_hz", "antiresonance_hz"}) {
    names.emplace_back(figure);
    names.push_back(std::string(figure) + "_std");
  }
  if (has_loop_) names.insert(names.end(), kMargins.begin(), kMargins.end());
  if (has_gap_) names.emplace_back("gap");
  if (has_position_) names.emplace_back("position_m");
  names.emplace_back("trusted");
  return names;
}

std::array<double, 3> Rows::margins(const LoopFigures& loop) const {
  if (!loop.known()) return {kUnknown, kUnknown, kUnknown};
  const auto& m = loop.margins();
  return {m.crossover_hz().value_or(kUnknown), m.phase_margin_deg().value_or(kUnknown), m.modulus_margin};
}

void Rows::add(const Row& row, const LoopFigures& loop) {
  if (options_.on_row) hand_out(row, loop);
  if (track_.rows++ % stride_ == 0) keep(row, loop);
}

void Rows::hand_out(const Row& row, const LoopFigures& loop) {
  flat_.assign({row.time_s});
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    flat_.push_back(row.reported[i].value);
    if (columns_[i].deviation) flat_.push_back(row.reported[i].deviation);
  }
  for (const OnlineValue& figure : {row.resonance, row.antiresonance}) {
    flat_.push_back(figure.value);
    flat_.push_back(figure.deviation);
  }
  if (has_loop_)
    for (const double value : margins(loop)) flat_.push_back(value);
  if (has_gap_) flat_.push_back(loop.gap());
  if (has_position_) flat_.push_back(row.position_m);
  flat_.push_back(row.trusted ? 1.0 : 0.0);
  options_.on_row(flat_);
}

void Rows::keep(const Row& row, const LoopFigures& loop) {
  track_.time_s.push_back(row.time_s);
  track_.lag_s.push_back(row.lag_s);
  track_.residual.push_back(row.residual);
  if (has_position_) track_.position_m.push_back(row.position_m);
  track_.trusted_rows.push_back(row.trusted);
  std::size_t line = 0, parameter = 0;
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    TrackSeries& series = columns_[i].line ? track_.lines[line++] : track_.parameters[parameter++];
    series.value.push_back(row.reported[i].value);
    if (columns_[i].deviation) series.std.push_back(row.reported[i].deviation);
  }
  const std::array<OnlineValue, 2> first{row.resonance, row.antiresonance};
  for (std::size_t i = 0; i < first.size(); ++i) {
    track_.figures[i].value.push_back(first[i].value);
    track_.figures[i].std.push_back(first[i].deviation);
  }
  const auto values = margins(loop);
  for (std::size_t i = 0; has_loop_ && i < values.size(); ++i)
    track_.figures[2 + i].value.push_back(values[i]);
  if (has_gap_) track_.figures.back().value.push_back(loop.gap());
}

}  // namespace resonid::identification::detail
