// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <identification/identify/judge/modes.hpp>
#include <resonid/base/constants.hpp>

namespace resonid::identification::detail {

namespace {

void put(const std::vector<fit::UncertainRoot>& roots, const char* kind, std::vector<Root>& to) {
  for (const auto& r : roots) to.push_back({r.value, r.covariance, kind});
}

/// ds = dz/(Ts z) turns and scales the error as it does the root.
void put_sampled(const std::vector<fit::UncertainRoot>& roots, const char* kind, double sample_time_s,
                 std::vector<Root>& to) {
  for (const auto& r : roots) {
    constexpr double kReal = 1e-9;
    const bool negative = r.value.real() <= 0.0 && std::abs(r.value.imag()) <= kReal * std::abs(r.value);
    if (negative || r.value == 0.0) continue;
    const std::complex<double> factor = 1.0 / (sample_time_s * r.value);
    Eigen::Matrix2d turn;
    turn << factor.real(), -factor.imag(), factor.imag(), factor.real();
    to.push_back({std::log(r.value) / sample_time_s, turn * r.covariance * turn.transpose(), kind});
  }
}

}  // namespace

std::vector<Root> roots_of(const fit::DriveModel& drive) {
  std::vector<Root> roots;
  put(drive.poles(), "pole", roots);
  put(drive.zeros(), "zero", roots);
  return roots;
}

std::vector<Root> roots_of(const fit::BlackBoxModel& model) {
  std::vector<Root> roots;
  put_sampled(model.poles(), "pole", model.transfer_function.sample_time_s, roots);
  put_sampled(model.zeros(), "zero", model.transfer_function.sample_time_s, roots);
  return roots;
}

std::vector<Root> roots_of(const Result& result) {
  if (result.model) return roots_of(result.model->drive);
  if (result.black_box) return roots_of(result.black_box->model);
  return {};
}

std::vector<data::Mode> modes_of(const fit::BlackBoxModel& model, double low_hz, double high_hz) {
  std::vector<data::Mode> found;
  for (const auto& root : roots_of(model)) {
    const double size = std::abs(root.value);
    const double f = size / kTwoPi;
    if (root.value.imag() <= 1e-9 * size || f < low_hz || f > high_hz) continue;
    const Eigen::Vector2d by_size(root.value.real() / size, root.value.imag() / size);
    const double std_hz = std::sqrt(std::max(0.0, by_size.dot(root.covariance * by_size))) / kTwoPi;
    const Eigen::Vector2d by_damping(-root.value.imag() * root.value.imag() / std::pow(size, 3),
                                     root.value.real() * root.value.imag() / std::pow(size, 3));
    const double damping_std = std::sqrt(std::max(0.0, by_damping.dot(root.covariance * by_damping)));
    found.push_back({root.kind == "zero", {f, std_hz}, {-root.value.real() / size, damping_std}, true});
  }
  std::sort(found.begin(), found.end(), [](const data::Mode& a, const data::Mode& b) {
    return a.frequency_hz.value < b.frequency_hz.value;
  });
  return found;
}

}  // namespace resonid::identification::detail
