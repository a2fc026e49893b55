// SPDX-License-Identifier: MIT
#include <bit>
#include <cstring>
#include <monitor/store/row_codec.hpp>

namespace resonid::monitor {
namespace {

using monitoring::kWatched;
using monitoring::Row;
using online::AxisGates;
using online::AxisRow;

static_assert(std::endian::native == std::endian::little, "rows are stored in little endian");

// Byte 0: format; 1: gates and trust; 2: verdict; 3, 4: mask of values; 5, 6: of standard deviations;
// 7: mask of the rest.
constexpr char kRowFormat = 1;
constexpr std::size_t kRowHeader = 8;
constexpr bool AxisGates::*kGates[] = {&AxisGates::ready,    &AxisGates::excited,  &AxisGates::converged,
                                       &AxisGates::physical, &AxisGates::residual, &AxisGates::complete,
                                       &AxisGates::covered};
constexpr unsigned kTrustedBit = 0x80;
constexpr double Row::*kRest[] = {&Row::coherence, &Row::residual_rms, &Row::lag_samples};
constexpr double kRestDefault[] = {AxisRow::kUnknown, AxisRow::kUnknown, 0.0};

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

unsigned byte_at(std::string_view bytes, std::size_t i) { return static_cast<unsigned char>(bytes[i]); }
unsigned mask_at(std::string_view bytes, std::size_t i) {
  return byte_at(bytes, i) | byte_at(bytes, i + 1) << 8U;
}
double double_at(std::string_view bytes, std::size_t index) {
  double value = 0.0;
  std::memcpy(&value, bytes.data() + kRowHeader + index * sizeof value, sizeof value);
  return value;
}
std::size_t ones(unsigned mask) { return static_cast<std::size_t>(std::popcount(mask)); }

}  // namespace

std::string encode_row(const Row& row) {
  std::string bytes(kRowHeader, '\0');
  const auto put = [&](double value, double absent, unsigned& mask, std::size_t bit) {
    if (same_bits(value, absent)) return;  // another not-a-number is a value
    mask |= 1U << bit;
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    bytes.append(raw, sizeof raw);
  };
  unsigned values = 0, stds = 0, rest = 0, gates = row.trusted ? kTrustedBit : 0;
  for (std::size_t i = 0; i < kWatched; ++i) put(row.figures[i].value, AxisRow::kUnknown, values, i);
  for (std::size_t i = 0; i < kWatched; ++i) put(row.figures[i].std, AxisRow::kUnknown, stds, i);
  for (std::size_t i = 0; i < std::size(kRest); ++i) put(row.*kRest[i], kRestDefault[i], rest, i);
  for (std::size_t i = 0; i < std::size(kGates); ++i)
    if (row.gates.*kGates[i]) gates |= 1U << i;
  const unsigned header[kRowHeader] = {static_cast<unsigned>(kRowFormat),
                                       gates,
                                       static_cast<unsigned>(row.verdict),
                                       values & 0xffU,
                                       values >> 8U,
                                       stds & 0xffU,
                                       stds >> 8U,
                                       rest};
  for (std::size_t i = 0; i < kRowHeader; ++i) bytes[i] = static_cast<char>(header[i]);
  return bytes;
}

std::optional<RowBytes> RowBytes::of(std::string_view bytes) noexcept {
  if (bytes.size() < kRowHeader || bytes[0] != kRowFormat) return std::nullopt;
  const unsigned values = mask_at(bytes, 3), stds = mask_at(bytes, 5), rest = byte_at(bytes, 7);
  constexpr unsigned kFigures = (1U << kWatched) - 1;
  if ((values | stds) > kFigures || rest >= 1U << std::size(kRest) ||
      byte_at(bytes, 2) >= std::size(online::kAxisVerdictNames))
    return std::nullopt;
  if (bytes.size() != kRowHeader + (ones(values) + ones(stds) + ones(rest)) * sizeof(double))
    return std::nullopt;
  return RowBytes(bytes);
}

bool RowBytes::trusted() const noexcept { return (byte_at(bytes_, 1) & kTrustedBit) != 0; }

online::Figure RowBytes::figure(monitoring::Watched watched) const noexcept {
  const unsigned bit = 1U << static_cast<unsigned>(watched);
  const unsigned values = mask_at(bytes_, 3), stds = mask_at(bytes_, 5);
  online::Figure figure;
  if ((values & bit) != 0) figure.value = double_at(bytes_, ones(values & (bit - 1)));
  if ((stds & bit) != 0) figure.std = double_at(bytes_, ones(values) + ones(stds & (bit - 1)));
  return figure;
}

Row RowBytes::row(std::uint64_t sample) const noexcept {
  Row row;
  row.sample = sample;
  for (std::size_t i = 0; i < kWatched; ++i) row.figures[i] = figure(static_cast<monitoring::Watched>(i));
  std::size_t index = ones(mask_at(bytes_, 3)) + ones(mask_at(bytes_, 5));
  for (std::size_t i = 0; i < std::size(kRest); ++i)
    if ((byte_at(bytes_, 7) >> i & 1U) != 0) row.*kRest[i] = double_at(bytes_, index++);
  for (std::size_t i = 0; i < std::size(kGates); ++i)
    row.gates.*kGates[i] = (byte_at(bytes_, 1) >> i & 1U) != 0;
  row.verdict = static_cast<online::AxisVerdict>(byte_at(bytes_, 2));
  row.trusted = trusted();
  return row;
}

}  // namespace resonid::monitor
