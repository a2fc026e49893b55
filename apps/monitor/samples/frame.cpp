// SPDX-License-Identifier: MIT
#include "monitor/samples/frame.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <utility>

#include "io/text_encoding.hpp"
#include "monitor/samples/crc32c.hpp"

namespace resonid::monitor {
namespace {

constexpr std::string_view kFrameMagic = "RSN1", kQuestionMagic = "RSNQ", kAnswerMagic = "RSNA";
constexpr std::size_t kFixedHeader = 46;  // up to the axis' name
constexpr std::size_t kChecksum = 4;
constexpr std::size_t kSlice = 65'536;
constexpr std::int64_t kNoTime = std::numeric_limits<std::int64_t>::min();
constexpr std::uint64_t kNoSample = std::numeric_limits<std::uint64_t>::max();

/// The number at `p`, written little endian.
template <class T>
T number_at(const char* p) noexcept {
  std::array<char, sizeof(T)> bytes;
  std::memcpy(bytes.data(), p, sizeof(T));
  if constexpr (std::endian::native == std::endian::big) std::reverse(bytes.begin(), bytes.end());
  return std::bit_cast<T>(bytes);
}

template <class T>
void put_number(std::string& text, T value) {
  auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
  if constexpr (std::endian::native == std::endian::big) std::reverse(bytes.begin(), bytes.end());
  text.append(bytes.data(), bytes.size());
}

constexpr std::size_t padded(std::size_t bytes) noexcept { return (bytes + 7) / 8 * 8; }

std::string finished(std::string text) {
  put_number(text, crc32c(text));
  return text;
}

std::string with_axis(std::string_view magic, std::string_view axis) {
  const std::string_view name = axis.substr(0, kLongestName);
  std::string text(magic);
  put_number(text, static_cast<std::uint32_t>(name.size()));
  text += name;
  text.resize(padded(text.size()), '\0');
  return text;
}

/// What begins at the start of `bytes`.
struct Beginning {
  enum class Kind { unfinished, garbage, message };
  Kind kind = Kind::unfinished;
  std::size_t bytes = 0;      ///< Of the message.
  std::string_view why = {};  ///< It is garbage.
};

Beginning short_message(std::string_view bytes, std::size_t after_name) {
  if (bytes.size() < 8) return {};
  const auto length = number_at<std::uint32_t>(bytes.data() + 4);
  if (length > kLongestName) return {Beginning::Kind::garbage, 0, "an axis' name longer than 255 bytes"};
  return {Beginning::Kind::message, padded(8 + length) + after_name + kChecksum};
}

/// Looks at the lengths only, which must agree: else a damaged one would have the decoder wait for bytes.
Beginning beginning_of(std::string_view bytes) {
  const std::string_view magic = bytes.substr(0, 4);
  if (magic != kFrameMagic.substr(0, magic.size()) && magic != kQuestionMagic.substr(0, magic.size()) &&
      magic != kAnswerMagic.substr(0, magic.size()))
    return {Beginning::Kind::garbage, 0, "'RSN1' required"};
  if (magic == kQuestionMagic) return short_message(bytes, 0);
  if (magic == kAnswerMagic) return short_message(bytes, 8);
  if (bytes.size() < kFixedHeader) return {};
  const char* const p = bytes.data();
  if (number_at<std::uint16_t>(p + 4) != 1) return {Beginning::Kind::garbage, 0, "version 1 required"};
  const std::size_t header = number_at<std::uint16_t>(p + 6), total = number_at<std::uint32_t>(p + 8);
  const std::uint64_t samples = number_at<std::uint32_t>(p + 12), columns = number_at<std::uint16_t>(p + 40);
  const auto type = number_at<std::uint8_t>(p + 42);
  if (total > kLongestFrame) return {Beginning::Kind::garbage, 0, "a frame longer than 1 000 000 bytes"};
  if (type != 1 && type != 2) return {Beginning::Kind::garbage, 0, "value type 1 or 2 required"};
  if (columns == 0 || columns > kMostColumns)
    return {Beginning::Kind::garbage, 0, "1 ... 64 columns required"};
  if (header % 8 != 0 || header < kFixedHeader || total != header + samples * columns * 4 * type + kChecksum)
    return {Beginning::Kind::garbage, 0, "lengths that do not agree"};
  return {Beginning::Kind::message, total};
}

bool good_name(std::string_view name) {
  return io::is_utf8(name) &&
         std::none_of(name.begin(), name.end(), [](char c) { return (c >= 0 && c < 0x20) || c == 0x7f; });
}

/// The names between the fixed header and the padding; false where they do not fit or are no names.
bool read_names(std::string_view header, std::string_view& axis, std::vector<std::string_view>& columns) {
  std::size_t at = kFixedHeader;
  const auto take = [&](std::size_t length) -> std::optional<std::string_view> {
    if (length > kLongestName || at + length > header.size()) return std::nullopt;
    const std::string_view name = header.substr(at, length);
    at += length;
    return good_name(name) ? std::optional(name) : std::nullopt;
  };
  const auto name = take(number_at<std::uint16_t>(header.data() + kFixedHeader - 2));
  if (!name) return false;
  axis = *name;
  for (std::string_view& column : columns) {
    if (at >= header.size()) return false;
    const std::size_t length = static_cast<unsigned char>(header[at++]);
    const auto found = take(length);
    if (!found || found->empty()) return false;
    column = *found;
  }
  return true;
}

template <class Float>
void read_values(const char* from, std::span<double> values) {
  for (double& value : values) {
    value = static_cast<double>(number_at<Float>(from));
    from += sizeof(Float);
  }
}

}  // namespace

expected<std::string, Error> encoded(const Arrival& arrival, ValueType type) {
  const std::size_t columns = arrival.columns.size();
  if (columns == 0 || columns > kMostColumns)
    return refuse("columns", "must be 1 ... 64", static_cast<double>(columns));
  if (arrival.axis.size() > kLongestName || !good_name(arrival.axis))
    return refuse("axis", "must be a name of at most 255 bytes of UTF-8");
  if (arrival.values.size() % columns != 0)
    return refuse("values", "must be whole samples", static_cast<double>(arrival.values.size()));
  if (!(arrival.sample_rate_hz >= 0.0) || std::isinf(arrival.sample_rate_hz))
    return refuse("sample_rate_hz", "must be finite, and 0 where it is not told", arrival.sample_rate_hz);
  std::string names(arrival.axis);
  for (const std::string_view column : arrival.columns) {
    if (column.empty() || column.size() > kLongestName || !good_name(column))
      return refuse("columns", "must have names of 1 ... 255 bytes of UTF-8");
    names += static_cast<char>(column.size());
    names += column;
  }
  const std::size_t header = padded(kFixedHeader + names.size());
  const std::size_t width = type == ValueType::float32 ? 4 : 8;
  const std::size_t total = header + arrival.values.size() * width + kChecksum;
  if (total > kLongestFrame)
    return refuse("values", "must fit a frame of 1 000 000 bytes", static_cast<double>(total));
  std::string text(kFrameMagic);
  text.reserve(total);
  put_number(text, std::uint16_t{1});
  put_number(text, static_cast<std::uint16_t>(header));
  put_number(text, static_cast<std::uint32_t>(total));
  put_number(text, static_cast<std::uint32_t>(arrival.samples()));
  put_number(text, arrival.first_sample.value_or(kNoSample));
  put_number(text, arrival.sample_rate_hz);
  put_number(text, arrival.time_ns.value_or(kNoTime));
  put_number(text, static_cast<std::uint16_t>(columns));
  put_number(text, static_cast<std::uint8_t>(type));
  put_number(text, std::uint8_t{0});
  put_number(text, static_cast<std::uint16_t>(arrival.axis.size()));
  text += names;
  text.resize(header, '\0');
  for (const double value : arrival.values) {
    if (type == ValueType::float32)
      put_number(text, static_cast<float>(value));
    else
      put_number(text, value);
  }
  return finished(std::move(text));
}

std::string encoded(const Question& question) { return finished(with_axis(kQuestionMagic, question.axis)); }

std::string encoded(const Acknowledgement& acknowledgement) {
  std::string text = with_axis(kAnswerMagic, acknowledgement.axis);
  put_number(text, acknowledgement.next_sample);
  return finished(std::move(text));
}

void FrameDecoder::add(std::string_view bytes, const std::function<void(const Message&)>& take) {
  while (!bytes.empty()) {
    const std::string_view slice = bytes.substr(0, kSlice);
    bytes.remove_prefix(slice.size());
    received_ += slice.size();
    std::size_t done = 0;
    if (rest_.empty()) {
      done = read_some(slice, take);
      rest_ = slice.substr(done);
    } else {
      rest_ += slice;
      done = read_some(rest_, take);
      rest_.erase(0, done);
    }
    done_ += done;
  }
}

void FrameDecoder::finish() {
  if (!rest_.empty()) skip(rest_, rest_.size(), "the stream ends within it");
  done_ += rest_.size();
  rest_.clear();
  in_garbage_ = false;
}

void FrameDecoder::release() {
  if (rest_.capacity() > kSlice) std::string().swap(rest_);
  if (values_.capacity() * sizeof(double) > kSlice) std::vector<double>().swap(values_);
}

/// Reads all whole messages; returns the bytes that are done with.
std::size_t FrameDecoder::read_some(std::string_view bytes, const std::function<void(const Message&)>& take) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const std::string_view rest = bytes.substr(done);
    const Beginning next = beginning_of(rest);
    if (next.kind == Beginning::Kind::unfinished) break;
    if (next.kind == Beginning::Kind::garbage) {
      const std::size_t another = rest.find('R', 1);
      const std::size_t count = std::min(another, rest.size());
      skip(rest, count, next.why);
      done += count;
      continue;
    }
    if (rest.size() < next.bytes) break;
    const std::string_view message = rest.substr(0, next.bytes);
    const std::string_view content = message.substr(0, message.size() - kChecksum);
    if (crc32c(content) == number_at<std::uint32_t>(content.data() + content.size())) {
      in_garbage_ = false;
      message_end_ = done_ + done + message.size();
      if (!read_frame(content, take)) {
        skip(message, message.size(), "names, a rate or flags that cannot be");
        in_garbage_ = false;
      }
      done += message.size();
      continue;
    }
    // There may be a right message within the wrong one (its writer was killed): looked for as long as that
    // does not mean to read everything many times, which a hostile sender could bring about.
    in_vain_ += message.size();
    const std::size_t count = in_vain_ > 4 * received_ ? message.size() : 1;
    skip(message, count, "its checksum is wrong");
    done += count;
  }
  return done;
}

bool FrameDecoder::read_frame(std::string_view content, const std::function<void(const Message&)>& take) {
  const char* const p = content.data();
  if (content.substr(0, 4) != kFrameMagic) {
    const std::string_view axis = content.substr(8, number_at<std::uint32_t>(p + 4));
    if (!good_name(axis)) return false;
    if (content.substr(0, 4) == kQuestionMagic)
      take(Question{axis});
    else
      take(Acknowledgement{axis, number_at<std::uint64_t>(p + content.size() - 8)});
    return true;
  }
  Arrival arrival;
  const std::string_view header = content.substr(0, number_at<std::uint16_t>(p + 6));
  columns_.resize(number_at<std::uint16_t>(p + 40));
  arrival.sample_rate_hz = number_at<double>(p + 24);
  if (number_at<std::uint8_t>(p + 43) != 0 || !(arrival.sample_rate_hz >= 0.0) ||
      std::isinf(arrival.sample_rate_hz) || !read_names(header, arrival.axis, columns_))
    return false;
  arrival.columns = columns_;
  if (const auto first = number_at<std::uint64_t>(p + 16); first != kNoSample) arrival.first_sample = first;
  if (const auto time = number_at<std::int64_t>(p + 32); time != kNoTime) arrival.time_ns = time;
  values_.resize(number_at<std::uint32_t>(p + 12) * columns_.size());
  if (number_at<std::uint8_t>(p + 42) == static_cast<std::uint8_t>(ValueType::float32))
    read_values<float>(p + header.size(), values_);
  else
    read_values<double>(p + header.size(), values_);
  arrival.values = values_;
  take(arrival);
  return true;
}

void FrameDecoder::skip(std::string_view bytes, std::size_t count, std::string_view why) {
  skipped_ += count;
  if (!std::exchange(in_garbage_, true))
    faults_.note(why.find("longer") == std::string_view::npos ? Fault::format : Fault::size,
                 fmt::format("no frame: {}; it begins '{}'", why, printable(bytes, 16)));
}

}  // namespace resonid::monitor
