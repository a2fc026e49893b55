// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <resonid/base/detail/byte_archive.hpp>
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

  /// As write() wrote it, where the reader is ok() then.
  explicit ArrivalCopy(ByteReader& from) {
    std::uint64_t columns = 0;
    from.get(axis_);
    from.get(columns);
    for (; columns > 0 && from.ok(); --columns) from.get(columns_.emplace_back());
    from.get(values_);
    from.get(ends_);
    get(from, numbers_.first_sample);
    get(from, numbers_.time_ns);
    from.get(numbers_.sample_rate_hz);
  }
  void write(ByteWriter& to) const {
    to.put(axis_);
    to.put(static_cast<std::uint64_t>(columns_.size()));
    for (const std::string& column : columns_) to.put(column);
    to.put(values_);
    to.put(ends_);
    put(to, numbers_.first_sample);
    put(to, numbers_.time_ns);
    to.put(numbers_.sample_rate_hz);
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
  template <class T>
  static void get(ByteReader& from, std::optional<T>& value) {
    bool there = false;
    T number{};
    from.get(there);
    from.get(number);
    if (there) value = number;
  }
  template <class T>
  static void put(ByteWriter& to, const std::optional<T>& value) {
    to.put(value.has_value());
    to.put(value.value_or(T{}));
  }

  std::string axis_;
  std::vector<std::string> columns_;
  std::vector<double> values_;
  std::vector<std::uint64_t> ends_;
  Arrival numbers_;  ///< Without what points to something.
};

}  // namespace resonid::monitor
