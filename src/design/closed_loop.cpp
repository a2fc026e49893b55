// SPDX-License-Identifier: MIT
#include "design/closed_loop.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

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
    default:
      return std::nullopt;
  }
}

LoopFunctions::LoopFunctions(const fit::SampledResponse& plant, LinearController controller)
    : plant_(plant), controller_(std::move(controller)) {}

double LoopFunctions::Values::size_of(Transfer transfer) const {
  const auto s = 1.0 / (1.0 + loop);
  switch (transfer) {
    case Transfer::sensitivity:
      return std::abs(s);
    case Transfer::complementary:
      return std::abs(loop * s);
    case Transfer::load_transfer:
      return std::abs(reference * load * s);
    case Transfer::controller_sensitivity:
      return std::abs(controller * s);
    case Transfer::process_sensitivity:
      return std::abs(loop / controller * s);
    default:
      return std::abs((1.0 - loop) * s);
  }
}

std::vector<LoopFunctions::Values> LoopFunctions::at(std::span<const double> frequencies_hz) const {
  const auto plant = plant_.at(frequencies_hz);
  const auto c = controller_.at(frequencies_hz);
  const auto& reference = controller_.reference_response();
  const auto r = reference ? reference(frequencies_hz) : c;
  std::vector<Values> values(frequencies_hz.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = {c[i] * plant[i].measured, c[i], plant[i].load, r[i]};
  return values;
}

Peak LoopFunctions::refined(Transfer transfer, double from_hz, double to_hz) const {
  // Four inner points at a time, since as many are worked out at once as cost one.
  constexpr int kInner = 4, kRounds = 22;
  Peak best{transfer, 0.0, from_hz, 0.0};
  for (int round = 0; round < kRounds; ++round) {
    std::array<double, kInner> points;
    for (int i = 0; i < kInner; ++i)
      points[static_cast<std::size_t>(i)] = from_hz + (to_hz - from_hz) * (i + 1) / (kInner + 1.0);
    const auto values = at(points);
    std::size_t top = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (values[i].size_of(transfer) > values[top].size_of(transfer)) top = i;
    }
    if (const double value = values[top].size_of(transfer); value > best.value) {
      best.value = value;
      best.frequency_hz = points[top];
    }
    const double width = (to_hz - from_hz) / (kInner + 1.0);
    from_hz = points[top] - width;
    to_hz = points[top] + width;
    if (width < 1e-9 * to_hz) break;  // the maximum is flat: its value has all digits
  }
  return best;
}

std::vector<Peak> LoopFunctions::peaks(const std::vector<double>& lines_hz, const Bounds& bounds,
                                       double least) const {
  const auto values = at(lines_hz);
  std::vector<Peak> found;
  for (const Transfer transfer : kTransfers) {
    const auto bound = bound_of(bounds, transfer);
    if (!bound) continue;
    const auto size = [&](std::size_t i) { return values[i].size_of(transfer); };
    for (std::size_t i = 0; i < values.size(); ++i) {
      const bool rises = i == 0 || size(i) >= size(i - 1),
                 falls = i + 1 == values.size() || size(i) >= size(i + 1);
      if (!rises || !falls || !(size(i) > least * *bound)) continue;
      Peak peak =
          refined(transfer, lines_hz[i == 0 ? 0 : i - 1], lines_hz[i + 1 == values.size() ? i : i + 1]);
      peak.bound = *bound;
      found.push_back(peak);
    }
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
    const auto top = static_cast<std::size_t>(std::max_element(sizes.begin(), sizes.end()) - sizes.begin());
    Peak best{transfer, sizes[top], lines_hz[top], 0.0};
    constexpr double kNear = 0.97;  // lines are near enough for a maximum to be seen
    for (std::size_t i = 0; i < sizes.size(); ++i) {
      const bool rises = i == 0 || sizes[i] >= sizes[i - 1];
      const bool falls = i + 1 == sizes.size() || sizes[i] >= sizes[i + 1];
      if (!rises || !falls || sizes[i] < kNear * sizes[top]) continue;
      const Peak peak =
          refined(transfer, lines_hz[i == 0 ? 0 : i - 1], lines_hz[i + 1 == sizes.size() ? i : i + 1]);
      if (peak.value > best.value) best = peak;
    }
    found.push_back(best);
  }
  return found;
}

Peak LoopFunctions::largest(Transfer transfer, const std::vector<double>& lines_hz) const {
  return largest_of({transfer}, lines_hz).front();
}

}  // namespace resonid::design
