// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "monitor/samples/arrival.hpp"

namespace resonid::monitor {

/// Joins the samples of lines into one Arrival per axis where they are consecutive. After flush() it keeps
/// the memory of at most 256 axes, 64 kB of values of each and a megabyte of names: the sender makes these,
/// and they may be endless.
class Batches {
 public:
  using Take = std::function<void(const Arrival&)>;

  /// Samples of one line: as an Arrival, with its `ends`. What it does not continue is taken first.
  void add(const Arrival& line, const Take& take);
  /// The line ends there: so do the last samples that came after `begin`.
  void end_line(std::uint64_t begin, std::uint64_t end);
  /// Everything is taken now.
  void flush(const Take& take);

 private:
  struct Batch {
    Arrival arrival;  ///< Without what points to something.
    std::vector<std::string> columns;
    std::vector<double> values;
    std::vector<std::uint64_t> ends;
    std::optional<std::int64_t> last_time_ns;  ///< Of the last line that told one.
  };

  void flush(std::string_view axis, Batch& batch, const Take& take);
  [[nodiscard]] static bool continues(const Batch& batch, const Arrival& line);

  std::map<std::string, Batch, std::less<>> batches_;  ///< By axis.
  std::size_t name_bytes_ = 0;                         ///< That came into `batches_`.
  std::vector<std::string_view> names_;
};

}  // namespace resonid::monitor
