// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <optional>
#include <resonid/base/enum_names.hpp>
#include <span>
#include <vector>

namespace resonid::design {

/// Upper bounds on maxima over frequency (docs/methods/tune.md 1); what is absent is free.
struct Bounds {
  std::optional<double> sensitivity;             ///< |S| = |1/(1 + C Gd)|: the inverse of the modulus margin.
  std::optional<double> complementary;           ///< |T| = |C Gd S|
  std::optional<double> load_transfer;           ///< |C GL S|, from the reference to the load's velocity.
  std::optional<double> controller_sensitivity;  ///< |C S|, Nm/(rad/s)
  std::optional<double> disk;                    ///< |S - T|: 2/alpha of a symmetric disk margin.
  std::optional<double> beyond_band =
      {};  ///< (1 + rho)|L| above the band in which a machine is known, rho being
           ///< what its model may err by there (docs/methods/tune.md 7.10).
};

/// What of a loop has a maximum over frequency.
enum class Transfer {
  sensitivity,
  complementary,
  load_transfer,
  controller_sensitivity,
  process_sensitivity,
  disk,
  beyond_band
};
inline constexpr std::array kTransfers = {Transfer::sensitivity,         Transfer::complementary,
                                          Transfer::load_transfer,       Transfer::controller_sensitivity,
                                          Transfer::process_sensitivity, Transfer::disk,
                                          Transfer::beyond_band};
inline constexpr EnumName<Transfer> kTransferNames[] = {
    {Transfer::sensitivity, "sensitivity"},
    {Transfer::complementary, "complementary_sensitivity"},
    {Transfer::load_transfer, "load_transfer"},
    {Transfer::controller_sensitivity, "controller_sensitivity"},
    {Transfer::process_sensitivity, "process_sensitivity"},
    {Transfer::disk, "disk"},
    {Transfer::beyond_band, "beyond_band"}};
[[nodiscard]] constexpr std::span<const EnumName<Transfer>> enum_names(Transfer) noexcept {
  return kTransferNames;
}
[[nodiscard]] std::optional<double> bound_of(const Bounds& bounds, Transfer transfer);
/// Every bound lower by a part of it.
[[nodiscard]] Bounds tightened(Bounds bounds, double part);
[[nodiscard]] std::vector<Transfer> bounded_transfers(const Bounds& bounds);

/// What a confidence is of.
enum class Guarantee {
  probability,  ///< Probability that every bound is met.
  ellipsoid     ///< Every machine of the ellipsoid that holds the true one with this probability meets them:
                ///< surer, and softer.
};
inline constexpr EnumName<Guarantee> kGuaranteeNames[] = {{Guarantee::probability, "probability"},
                                                          {Guarantee::ellipsoid, "ellipsoid"}};
[[nodiscard]] constexpr std::span<const EnumName<Guarantee>> enum_names(Guarantee) noexcept {
  return kGuaranteeNames;
}

}  // namespace resonid::design
