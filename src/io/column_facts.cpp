// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>
#include <resonid/io/detail/column_facts.hpp>

#include "io/columns.hpp"

namespace resonid::io {
namespace {

const char* word_of(const SignalSense& sense) {
  switch (sense.kind) {
    case SignalSense::Kind::time:
      return "time";
    case SignalSense::Kind::sample_number:
      return "sample number";
    case SignalSense::Kind::torque:
      return sense.commanded && !sense.actual ? "torque, commanded" : "torque";
    case SignalSense::Kind::current:
      return sense.commanded && !sense.actual ? "current, commanded" : "current";
    case SignalSense::Kind::velocity:
      return sense.commanded && !sense.actual ? "velocity, commanded" : "velocity";
    case SignalSense::Kind::position:
      return sense.commanded && !sense.actual ? "position, commanded" : "position";
    case SignalSense::Kind::acceleration:
      return "acceleration";
    case SignalSense::Kind::none:
      break;
  }
  return "";
}

}  // namespace

std::vector<ColumnFacts> column_facts(const Table& table) {
  std::vector<ColumnFacts> facts;
  for (std::size_t i = 0; i < table.names.size(); ++i) {
    ColumnFacts column;
    column.name = table.names[i];
    column.unit = named_unit(table, i).unit;
    column.guess = word_of(sense_of_column(table, i));
    column.least = std::numeric_limits<double>::infinity();
    column.greatest = -column.least;
    for (const double x : table.columns[i]) {
      column.missing += std::isnan(x) ? 1U : 0U;
      if (std::isnan(x)) continue;
      column.least = std::min(column.least, x);
      column.greatest = std::max(column.greatest, x);
    }
    facts.push_back(std::move(column));
  }
  return facts;
}

}  // namespace resonid::io
