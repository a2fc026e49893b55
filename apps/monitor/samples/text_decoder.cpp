// SPDX-License-Identifier: MIT
#include "monitor/samples/text_decoder.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <type_traits>
#include <utility>

#include "io/csv_format.hpp"
#include "monitor/samples/frame.hpp"
#include "monitor/samples/text_values.hpp"

namespace resonid::monitor {
namespace {

using nlohmann::json;

constexpr std::size_t kTextSlice = 65'536;
constexpr std::size_t kMostNumbers = 250'000;  // of one object
constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

/// The cells of a line; quotes around them are taken away.
void split_line(std::string_view text, char separator, std::vector<std::string_view>& cells) {
  cells.clear();
  while (true) {
    const std::size_t length = separator == ' ' ? text.find_first_of(" \t") : text.find(separator);
    std::string_view cell = trimmed(text.substr(0, length));
    if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"') cell = cell.substr(1, cell.size() - 2);
    if (separator != ' ' || !cell.empty()) cells.push_back(cell);
    if (length == std::string_view::npos || cells.size() > 2 * kMostColumns) return;
    text.remove_prefix(length + 1);
  }
}

/// What stands between the columns of a line, of which there are `columns` (0: as many as possible).
char separator_of(std::string_view text, std::size_t columns) {
  char best = ' ';
  std::size_t most = 0;
  for (const char separator : {'\t', ';', ','}) {
    const auto count = static_cast<std::size_t>(std::count(text.begin(), text.end(), separator));
    if (columns > 0 ? count + 1 == columns && most == 0 : count > most) {
      best = separator;
      most = count;
    }
  }
  return best;
}

bool is_text(std::string_view cell) {
  return !cell.empty() && !read_value(cell, true) && !read_time(cell).readable;
}

bool is_time_name(std::string_view name) { return name == "time" || name == "timestamp"; }

/// JSON's value as the text that it would be in another format; nothing for what is no single value.
std::optional<std::string> text_of(const json& value) {
  if (const auto* text = value.get_ptr<const std::string*>()) return *text;
  if (value.is_number_integer() || value.is_number_unsigned() || value.is_number_float()) return value.dump();
  return std::nullopt;
}

double number_of(const json& value) {
  if (value.is_number()) return value.get<double>();
  const auto* text = value.get_ptr<const std::string*>();
  return text == nullptr ? kNoNumber : read_value(*text).value_or(kNoNumber);
}

/// NaN and infinities, which some programs write and JSON does not have, as null.
std::string without_nan(std::string_view text) {
  std::string changed;
  while (!text.empty()) {
    std::size_t length = 0;
    for (const std::string_view word : {"-Infinity", "Infinity", "NaN"})
      if (text.substr(0, word.size()) == word) length = word.size();
    if (length > 0)
      changed += "null";
    else
      changed += text.front();
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return changed;
}

/// The next part of a line of the line protocol up to one of `marks` that is neither escaped nor in quotes.
std::string_view take_until(std::string_view& text, std::string_view marks) {
  bool quoted = false;
  std::size_t at = 0;
  for (; at < text.size(); ++at) {
    if (text[at] == '\\') {
      ++at;
      continue;
    }
    if (text[at] == '"') quoted = !quoted;
    if (!quoted && marks.find(text[at]) != std::string_view::npos) break;
  }
  const std::string_view part = text.substr(0, at);
  text.remove_prefix(part.size());
  return part;
}

std::string unescaped(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\\' && i + 1 < text.size()) ++i;
    result += text[i];
  }
  return result;
}

}  // namespace

TextDecoder::TextDecoder(Format format, FaultLog& faults) : format_(std::move(format)), faults_(faults) {
  if (!format_.columns.empty()) set_names(format_.columns);
}

void TextDecoder::seek(std::uint64_t byte) {
  consumed_ = byte;
  rest_.clear();
  too_long_ = false;
}

void TextDecoder::add(std::string_view bytes, const Take& take) {
  while (!bytes.empty()) {
    const std::string_view slice = bytes.substr(0, kTextSlice);
    const std::size_t length = slice.find('\n');
    if (length == std::string_view::npos) {
      bytes.remove_prefix(slice.size());
      if (too_long_) {
        consumed_ += slice.size();
        continue;
      }
      rest_ += slice;
      if (rest_.size() <= kLongestLine) continue;
      fault(Fault::size, "a line longer than 1 000 000 bytes", rest_);
      consumed_ += rest_.size();
      rest_.clear();
      too_long_ = true;
      continue;
    }
    bytes.remove_prefix(length + 1);
    const std::uint64_t end = consumed_ + rest_.size() + length + 1;
    if (!std::exchange(too_long_, false)) {
      if (rest_.empty()) {
        read_line(slice.substr(0, length), end, take);
      } else {
        rest_ += slice.substr(0, length);
        read_line(rest_, end, take);
      }
    }
    rest_.clear();
    consumed_ = end;
  }
  batches_.flush(take);
}

void TextDecoder::finish(const Take& take) {
  if (!rest_.empty()) read_line(rest_, consumed_ + rest_.size(), take);
  batches_.flush(take);
  seek(0);
}

void TextDecoder::break_off() {
  if (!trimmed(rest_).empty()) fault(Fault::format, "a line that breaks off", rest_);
  seek(0);
}

void TextDecoder::message(std::string_view text, const Take& take) {
  seek(0);
  if (text.size() > kLongestLine) return fault(Fault::size, "a message longer than 1 000 000 bytes", text);
  const bool document = format_.kind == SampleFormat::json && text.find('\n') != std::string_view::npos &&
                        read_document(text, 0, text.size(), take);
  if (!document) add(text, take);
  finish(take);
  release();
}

void TextDecoder::release() {
  batches_ = {};
  const auto shrink = [](auto& buffer) {
    if (buffer.capacity() * sizeof(buffer[0]) > kTextSlice) std::decay_t<decltype(buffer)>().swap(buffer);
  };
  shrink(rest_);
  shrink(scratch_);
  shrink(cells_);
  shrink(columns_);
  shrink(values_);
  shrink(ends_);
}

void TextDecoder::adopt_names(const TextDecoder& other, bool same_file) {
  if (other.names_.empty() || !format_.columns.empty()) return;
  set_names(other.names_);
  names_used_ = same_file && other.names_used_;
  separator_ = other.separator_;
}

void TextDecoder::fault(Fault kind, std::string_view what, std::string_view text) {
  faults_.note(kind, fmt::format("{}: '{}'", what, printable(text)));
}

void TextDecoder::read_line(std::string_view text, std::uint64_t end, const Take& take) {
  const std::uint64_t begin = consumed_;
  if (begin == 0 && text.substr(0, 3) == "\xEF\xBB\xBF") text.remove_prefix(3);
  text = trimmed(text);
  if (text.empty() || (text.front() == '#' && format_.kind != SampleFormat::json)) return;
  switch (format_.kind) {
    case SampleFormat::csv:
      return read_csv(text, end, take);
    case SampleFormat::line_protocol:
      return read_point(text, end, take);
    case SampleFormat::frame:
      return;
    case SampleFormat::json:
      if (!read_document(text, begin, end, take)) fault(Fault::format, "no JSON, which is required", text);
  }
}

/// Gives samples with these columns to the batches; `arrival` has the rest of them.
void TextDecoder::give(Arrival arrival, std::span<const std::string_view> columns, const Take& take) {
  arrival.columns = columns;
  arrival.values = values_;
  arrival.ends = ends_;
  batches_.add(arrival, take);
}

void TextDecoder::set_names(std::vector<std::string> names) {
  names_ = std::move(names);
  names_used_ = false;
  axis_ = sample_ = overruns_ = time_ = std::nullopt;
  value_names_.clear();
  for (std::size_t c = 0; c < names_.size(); ++c) {
    if (!axis_ && names_[c] == "axis")
      axis_ = c;
    else if (!sample_ && names_[c] == "sample")
      sample_ = c;
    else if (!overruns_ && format_.sample_wraps && names_[c] == kOverrunsColumn)
      overruns_ = c;
    else if (!time_ && is_time_name(names_[c]))
      time_ = c;
    else
      value_names_.push_back(names_[c]);
  }
}

/// Whether a line is the names of columns. Those that are there are replaced where they were no good so far,
/// or share a name with the new ones: else a line of words or of garbage would end the reading. Those that
/// were told stay.
bool TextDecoder::read_names(std::string_view text) {
  const char separator = separator_of(text, 0);
  std::vector<std::string> names;
  for (const auto& field : io::split_fields(separator, text)) names.push_back(field.text);
  if (separator == ' ') std::erase(names, "");
  if (names.size() > 1 && names.back().empty()) names.pop_back();
  const auto is_name = [](const std::string& name) {
    return is_text(name) && printable(name, name.size()) == name;
  };
  if (!std::all_of(names.begin(), names.end(), is_name)) return false;
  const auto known = [&](const std::string& name) {
    return std::find(names_.begin(), names_.end(), name) != names_.end();
  };
  const bool is_again = std::any_of(names.begin(), names.end(), known);
  if (!format_.columns.empty()) return is_again || names.size() == names_.size();
  if (!is_again && (names_used_ || (names.size() < 2 && names_.size() > 1))) return false;
  if (names.size() > kMostColumns) {
    fault(Fault::size, "more than 64 columns", text);
    return true;
  }
  for (const char* name : {"axis", "sample"})
    if (std::count(names.begin(), names.end(), name) > 1) {
      fault(Fault::columns, fmt::format("several columns have the name '{}'", name), text);
      return true;
    }
  separator_ = separator;
  set_names(std::move(names));
  return true;
}

void TextDecoder::read_csv(std::string_view text, std::uint64_t end, const Take& take) {
  const char separator =
      separator_ == '\0' && !names_.empty() ? separator_of(text, names_.size()) : separator_;
  if (separator != '\0') split_line(text, separator, cells_);
  // from the end: what is text stands in front
  const bool numbers = separator != '\0' && !std::all_of(cells_.rbegin(), cells_.rend(), is_text);
  if (!numbers && read_names(text)) return;
  if (names_.empty()) return fault(Fault::columns, "no names of columns come before this line", text);
  if (!numbers) return fault(Fault::format, "no numbers", text);
  if (cells_.size() == names_.size() + 1 && cells_.back().empty()) cells_.pop_back();
  if (cells_.size() != names_.size())
    return fault(Fault::format, fmt::format("{} cells, {} are required", cells_.size(), names_.size()), text);
  Arrival line;
  line.axis = axis_ ? cells_[*axis_] : std::string_view(format_.axis);
  values_.clear();
  std::uint64_t overruns = 0;
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    if (c == axis_) continue;
    if (c == sample_) {
      line.first_sample = format_.sample_wraps ? read_wrapped_index(cells_[c]) : read_index(cells_[c]);
      if (!line.first_sample) return fault(Fault::format, "the sample is no index", text);
    } else if (c == overruns_) {
      const auto counted = read_wrapped_index(cells_[c]);
      if (!counted) return fault(Fault::format, "the overruns are no count", text);
      overruns = *counted;
    } else if (c == time_) {
      const ReadTime time = read_time(cells_[c]);
      if (!time.readable) return fault(Fault::format, "the time is none", text);
      line.time_ns = time.time_ns;
    } else {
      values_.push_back(read_value(cells_[c], separator != ',').value_or(kNoNumber));
    }
  }
  if (line.first_sample && overruns_) line.first_sample = (*line.first_sample + overruns) % kIndexTurn;
  names_used_ = true;
  separator_ = separator;
  if (values_.empty()) return fault(Fault::columns, "no columns of values", text);
  ends_.assign(1, end);
  give(line, value_names_, take);
}

/// A JSON document; false where it is none.
bool TextDecoder::read_document(std::string_view text, std::uint64_t begin, std::uint64_t end,
                                const Take& take) {
  json document = json::parse(text, nullptr, false);
  if (document.is_discarded() &&
      (text.find("NaN") != std::string_view::npos || text.find("Infinity") != std::string_view::npos))
    document = json::parse(without_nan(text), nullptr, false);
  if (document.is_discarded()) return false;
  std::uint64_t reached = begin;
  if (document.is_array()) {
    for (const json& object : document) read_object(object, text, reached, take);
  } else {
    read_object(document, text, reached, take);
  }
  batches_.end_line(begin, end);
  return true;
}

/// @param reached where the sample before ends; each takes one byte, since only the line's end is known
void TextDecoder::read_object(const json& object, std::string_view text, std::uint64_t& reached,
                              const Take& take) {
  if (!object.is_object()) return fault(Fault::format, "an object of names and values is required", text);
  Arrival line;
  line.axis = format_.axis;
  columns_.clear();
  std::optional<std::size_t> samples;
  std::vector<const json*> values;
  for (auto item = object.begin(); item != object.end(); ++item) {
    const std::string& name = item.key();
    const json& value = item.value();
    if (name == "axis") {
      const auto* axis = value.get_ptr<const std::string*>();
      if (axis == nullptr) return fault(Fault::format, "the axis must be a text", text);
      line.axis = *axis;
    } else if (name == "sample") {
      const auto index = text_of(value);
      line.first_sample = index ? read_index(*index) : std::nullopt;
      if (!line.first_sample) return fault(Fault::format, "the sample is no index", text);
    } else if (is_time_name(name)) {
      const auto time = text_of(value);
      const ReadTime read = time ? read_time(*time) : ReadTime{};
      if (!read.readable) return fault(Fault::format, "the time is none", text);
      line.time_ns = read.time_ns;
    } else if (name == "rate") {
      line.sample_rate_hz = number_of(value);
    } else if (value.is_array()) {
      if (samples && *samples != value.size())
        return fault(
            Fault::format,
            fmt::format("'{}' has {} values, another column {}", printable(name), value.size(), *samples),
            text);
      samples = value.size();
      columns_.push_back(name);
      values.push_back(&value);
    } else if (value.is_number() || value.is_null() || value.is_string()) {
      columns_.push_back(name);
      values.push_back(&value);
    }
  }
  if (columns_.empty() || columns_.size() > kMostColumns)
    return fault(Fault::columns, fmt::format("{} columns of values; 1 ... 64 are required", columns_.size()),
                 text);
  if (samples.value_or(1) >
      kMostNumbers / columns_.size())  // one number may stand for all samples of a column
    return fault(Fault::size, fmt::format("{} samples of {} columns", *samples, columns_.size()), text);
  values_.clear();
  ends_.clear();
  for (std::size_t k = 0; k < samples.value_or(1); ++k) {
    for (const json* value : values) values_.push_back(number_of(value->is_array() ? (*value)[k] : *value));
    ends_.push_back(++reached);
  }
  if (!ends_.empty()) give(line, columns_, take);
}

/// A line of the line protocol: measurement,tag=value field=value,field=value time
void TextDecoder::read_point(std::string_view text, std::uint64_t end, const Take& take) {
  const std::string_view whole = text;
  std::string_view axis = take_until(text, ", ");
  Arrival line;
  while (!text.empty() && text.front() == ',') {
    text.remove_prefix(1);
    const std::string_view tag = take_until(text, ", ");
    if (tag.substr(0, 5) == "axis=") axis = tag.substr(5);
  }
  scratch_ = unescaped(axis);
  line.axis = scratch_;
  columns_.clear();
  values_.clear();
  std::size_t fields = 0;
  do {
    if (text.empty()) break;
    text.remove_prefix(1);
    const std::string_view name = take_until(text, "=, ");
    if (name.empty() || text.empty() || text.front() != '=')
      return fault(Fault::format, "name=value required", whole);
    text.remove_prefix(1);
    std::string_view value = take_until(text, ", ");
    if (!value.empty() && (value.back() == 'i' || value.back() == 'u')) value.remove_suffix(1);
    ++fields;
    if (name == "sample") {
      line.first_sample = read_index(value);
      if (!line.first_sample) return fault(Fault::format, "the sample is no index", whole);
    } else if (name == "rate") {
      line.sample_rate_hz = read_value(value).value_or(kNoNumber);
    } else if (const auto number = read_value(value)) {
      columns_.push_back(name);
      values_.push_back(*number);
    }
  } while (!text.empty() && text.front() == ',');
  text = trimmed(text);
  if (fields == 0) return fault(Fault::format, "no fields", whole);
  if (columns_.empty() || columns_.size() > kMostColumns)
    return fault(Fault::columns, fmt::format("{} columns of values; 1 ... 64 are required", columns_.size()),
                 whole);
  if (!text.empty()) {
    const ReadTime time = read_time(text);
    if (!time.readable) return fault(Fault::format, "the time is none", whole);
    line.time_ns = time.time_ns;
  }
  ends_.assign(1, end);
  give(line, columns_, take);
}

}  // namespace resonid::monitor
