// SPDX-License-Identifier: MIT
#include "monitor/service/baseline_curve.hpp"

#include <bit>
#include <cstdint>
#include <resonid/base/detail/byte_archive.hpp>

namespace resonid::monitor {
namespace {

// Format, then three columns, each with its length before it: 64-bit numbers in little endian.
constexpr std::uint64_t kCurveFormat = 1;
static_assert(std::endian::native == std::endian::little, "curves are stored in little endian");

}  // namespace

std::vector<std::byte> curve_bytes(const monitoring::ResponseCurve& curve) {
  if (curve.frequency_hz.empty()) return {};
  ByteWriter to;
  to.put(kCurveFormat);
  to.put(curve.frequency_hz);
  to.put(curve.plant);
  to.put(curve.std);
  return to.take();
}

std::optional<monitoring::ResponseCurve> curve_of(std::span<const std::byte> bytes) {
  monitoring::ResponseCurve curve;
  std::uint64_t format = 0;
  ByteReader from(bytes);
  from.get(format);
  from.get(curve.frequency_hz);
  from.get(curve.plant);
  from.get(curve.std);
  const std::size_t points = curve.frequency_hz.size();
  if (!from.ok() || !from.at_end() || format != kCurveFormat || points == 0 || curve.plant.size() != points ||
      (!curve.std.empty() && curve.std.size() != points))
    return std::nullopt;
  return curve;
}

}  // namespace resonid::monitor
