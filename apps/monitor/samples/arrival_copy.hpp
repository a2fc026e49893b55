// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "monitor/samples/arrival.hpp"

namespace resonid::monitor {

/// An Arrival that outlives the buffers it came in.
class ArrivalCopy {
 public:
  explicit ArrivalCopy(const Arrival& arrival)
      : axis_(arrival.axis),
        columns_(arrival.columns.begin(), arrival.columns.end()),
        values_(arrival.values.begin(), arrival.values.end()),
        ends_(arrival.ends.begin(), arrival.ends.end()),
        numbers_(arrival) {
    numbers_.axis = {};
    numbers_.columns = {};
    numbers_.values = {};
    numbers_.ends = {};
  }

  [[nodiscard]] const std::string& axis() const noexcept { return axis_; }
  /// @param columns for the names; they and this outlive what is returned
  [[nodiscard]] Arrival arrival(std::vector<std::string_view>& columns) const {
    columns.assign(columns_.begin(), columns_.end());
    Arrival arrival = numbers_;
    arrival.axis = axis_;
    arrival.columns = columns;
    arrival.values = values_;
    arrival.ends = ends_;
    return arrival;
  }

 private:
  std::string axis_;
  std::vector<std::string> columns_;
  std::vector<double> values_;
  std::vector<std::uint64_t> ends_;
  Arrival numbers_;  ///< Without what points to something.
};

}  // namespace resonid::monitor
