// SPDX-License-Identifier: MIT
#include "design/closed_loop.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "design/maxima.hpp"
#include "linalg/decompositions.hpp"

namespace resonid::design {

double ClosedLoop::spectral_radius() const { return linalg::eigenvalues(a).cwiseAbs().maxCoeff(); }

ClosedLoop closed_loop(const fit::SampledStates& drive, const ControllerStates& controller) {
  const Eigen::Index n = drive.a.rows(), m = controller.a.rows();
  ClosedLoop loop;
  loop.sample_time_s = drive.sample_time_s;
  loop.a.setZero(n + m, n + m);
  loop.a.topLeftCorner(n, n) = drive.a - controller.d * drive.command * drive.measured;
  loop.a.topRightCorner(n, m) = drive.command * controller.c;
  loop.a.bottomLeftCorner(m, n) = -controller.b * drive.measured;
  loop.a.bottomRightCorner(m, m) = controller.a;
  loop.reference.resize(n + m);
  loop.reference << controller.d * drive.command, controller.b;
  loop.load_torque.setZero(n + m);
  loop.load_torque.head(n) = drive.load_torque;
  for (auto* row : {&loop.measured, &loop.load, &loop.torque}) row->setZero(n + m);
  loop.measured.head(n) = drive.measured;
  loop.load.head(n) = drive.load;
  loop.torque << -controller.d * drive.measured, controller.c;
  loop.torque_by_reference = controller.d;
  return loop;
}

std::optional<double> bound_of(const Bounds& bounds, Transfer transfer) {
  switch (transfer) {
    case Transfer::sensitivity:
      return bounds.sensitivity;
    case Transfer::complementary:
      return bounds.complementary;
    case Transfer::load_transfer:
      return bounds.load_transfer;
    case Transfer::controller_sensitivity:
      return bounds.controller_sensitivity;
    case Transfer::disk:
      return bounds.disk;
    case Transfer::beyond_band:
      return bounds.beyond_band;
    default:
      return std::nullopt;
  }
}

Bounds tightened(Bounds bounds, double part) {
  for (auto* bound : {&bounds.sensitivity, &bounds.complementary, &bounds.load_transfer,
                      &bounds.controller_sensitivity, &bounds.disk, &bounds.beyond_band})
    if (*bound) **bound /= 1.0 + part;
  return bounds;
}

std::vector<Transfer> bounded_transfers(const Bounds& bounds) {
  std::vector<Transfer> transfers;
  std::copy_if(kTransfers.begin(), kTransfers.end(), std::back_inserter(transfers),
               [&](Transfer transfer) { return bound_of(bounds, transfer).has_value(); });
  return transfers;
}

LoopFunctions::LoopFunctions(const fit::SampledResponse& plant, LinearController controller,
                             double known_to_hz)
    : plant_(plant), controller_(std::move(controller)), known_to_hz_(known_to_hz) {}

double LoopFunctions::Values::size_of(Transfer transfer) const {
  const auto square = [](const std::complex<double>& x) { return x.real() * x.real() + x.imag() * x.imag(); };
  const double returned = square(1.0 + loop);
  switch (transfer) {
    case Transfer::sensitivity:
      return 1.0 / std::sqrt(returned);
    case Transfer::complementary:
      return std::sqrt(square(loop) / returned);
    case Transfer::load_transfer:
      return std::sqrt(square(reference) * square(load) / returned);
    case Transfer::controller_sensitivity:
      return std::sqrt(square(controller) / returned);
    case Transfer::process_sensitivity:
      return std::sqrt(square(loop) / (square(controller) * returned));
    case Transfer::beyond_band:
      return beyond * std::sqrt(square(loop));
    default:
      return std::sqrt(square(1.0 - loop) / returned);
  }
}

std::vector<LoopFunctions::Values> LoopFunctions::at(std::span<const double> frequencies_hz) const {
  const auto plant = plant_.at(frequencies_hz);
  const auto c = controller_.at(frequencies_hz);
  const auto& reference = controller_.reference_response();
  const auto r = reference ? reference(frequencies_hz) : c;
  std::vector<Values> values(frequencies_hz.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = {c[i] * plant[i].measured, c[i], plant[i].load, r[i],
                 weight_beyond(frequencies_hz[i], known_to_hz_)};
  return values;
}

std::vector<Peak> LoopFunctions::peaks(const std::vector<double>& lines_hz, const Bounds& bounds,
                                       double least) const {
  const auto values = at(lines_hz);
  std::vector<double> sizes(values.size());
  std::vector<Peak> found;
  for (const Transfer transfer : kTransfers) {
    const auto bound = bound_of(bounds, transfer);
    if (!bound) continue;
    std::transform(values.begin(), values.end(), sizes.begin(),
                   [&](const Values& v) { return v.size_of(transfer); });
    for (const auto& top : maxima_between(lines_hz, sizes, least * *bound, sizes_of(transfer)))
      found.push_back({transfer, top.value, top.frequency_hz, *bound});
  }
  return found;
}

std::vector<Peak> LoopFunctions::largest_of(const std::vector<Transfer>& transfers,
                                            const std::vector<double>& lines_hz) const {
  const auto values = at(lines_hz);
  std::vector<double> sizes(values.size());
  std::vector<Peak> found;
  for (const Transfer transfer : transfers) {
    std::transform(values.begin(), values.end(), sizes.begin(),
                   [&](const Values& v) { return v.size_of(transfer); });
    const auto top = largest_between(lines_hz, sizes, sizes_of(transfer));
    found.push_back({transfer, top.value, top.frequency_hz, 0.0});
  }
  return found;
}

Peak LoopFunctions::largest(Transfer transfer, const std::vector<double>& lines_hz) const {
  return largest_of({transfer}, lines_hz).front();
}

}  // namespace resonid::design
