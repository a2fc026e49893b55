// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "monitor/samples/arrival.hpp"
#include "monitor/samples/batches.hpp"
#include "monitor/samples/faults.hpp"
#include "monitor/samples/format.hpp"

namespace resonid::monitor {

inline constexpr std::size_t kLongestLine = 1'000'000;  ///< Bytes.

/// Reads samples from a stream of lines, of any number of axes:
///
/// - CSV: numbers separated by comma, semicolon, tab or blanks, also with a decimal comma; columns `axis`,
///   `sample`, `time` or `timestamp`, all others by their names. Names may come again; `#` begins a comment.
/// - JSON: an object per line, or an array of objects: "axis", "sample", "time" or "timestamp", "rate" (Hz);
///   all others are numbers, null or arrays of them, one element per sample. A message may be one document of
///   several lines. NaN is read as null.
/// - InfluxDB line protocol: the axis is the tag `axis`, else the measurement; fields `sample` and `rate` are
///   as above, the other numeric ones are columns; the time stands at the end.
///
/// Times are UNIX times in s, ms, us or ns, told apart by their size, or ISO 8601 (UTC where no zone stands);
/// smaller numbers are not of this epoch and are passed over. A value that is no number is not a number in
/// the Arrival. What cannot be used is counted as `format`, `columns` or `size`, with an example, and left
/// out. Keeps at most kLongestLine + 64 kB of text, and the samples of one add().
class TextDecoder {
 public:
  using Take = Batches::Take;

  /// @param format of lines: any but frames
  TextDecoder(Format format, FaultLog& faults);

  /// Takes the next bytes; a line that is not whole is kept until the rest of it comes.
  void add(std::string_view bytes, const Take& take);
  /// The stream ends here: what is left is a line. The next bytes are those of another one (names of columns
  /// are kept).
  void finish(const Take& take);
  /// The stream breaks off here: half a line is a fault, since what it lacks may be digits.
  void break_off();
  /// A message that is whole. Little memory is kept for the next one: there may be a decoder for each of many
  /// topics.
  void message(std::string_view text, const Take& take);
  /// CSV whose columns have no names yet: its lines cannot be read.
  [[nodiscard]] bool wants_names() const noexcept {
    return format_.kind == SampleFormat::csv && names_.empty();
  }
  /// Names of the columns of CSV, as far as they are known.
  [[nodiscard]] const std::vector<std::string>& names() const noexcept { return names_; }
  /// Names of columns as that one has found them, where it has: in what was read of a file before.
  ///
  /// @param same_file whether other names that come next are garbage where they would have been for that one
  void adopt_names(const TextDecoder& other, bool same_file);
  /// The next byte is this one of its stream, as Arrival::ends counts: for a reader that goes on within a
  /// file. At the beginning of a line.
  void seek(std::uint64_t byte);

 private:
  struct Line;

  void read_line(std::string_view text, std::uint64_t end, const Take& take);
  void read_csv(std::string_view text, std::uint64_t end, const Take& take);
  [[nodiscard]] bool read_names(std::string_view text);
  void set_names(std::vector<std::string> names);
  void release();
  [[nodiscard]] bool read_document(std::string_view text, std::uint64_t begin, std::uint64_t end,
                                   const Take& take);
  void read_object(const nlohmann::json& object, std::string_view text, std::uint64_t& reached,
                   const Take& take);
  void read_point(std::string_view text, std::uint64_t end, const Take& take);
  void give(Arrival arrival, std::span<const std::string_view> columns, const Take& take);
  void fault(Fault kind, std::string_view what, std::string_view text);

  Format format_;
  FaultLog& faults_;
  Batches batches_;
  std::string rest_;            ///< The beginning of a line.
  std::uint64_t consumed_ = 0;  ///< Bytes of the stream before it.
  bool too_long_ = false;       ///< The end of a line is looked for that is too long.

  // CSV
  char separator_ = '\0';  ///< '\0': not known; ' ': blanks.
  std::vector<std::string> names_;
  bool names_used_ = false;                                     ///< A line of numbers has fitted them.
  std::optional<std::size_t> axis_, sample_, overruns_, time_;  ///< Their columns.
  std::vector<std::string_view> value_names_;                   ///< Of the other columns.

  std::vector<std::string_view> cells_, columns_;
  std::vector<double> values_;
  std::vector<std::uint64_t> ends_;
  std::string scratch_;
};

}  // namespace resonid::monitor
