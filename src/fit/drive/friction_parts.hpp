// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <fit/drive/sampled_drive.hpp>

// Dry friction within a sample: a torque that changes sign there acts on a resonance otherwise than its mean.
namespace resonid::fit::detail {

/// A sample's parts, in each of which the friction torque is taken for even. One part leaves 15 ... 25 times
/// the error of four where a PRBS turns a drive around at a resonance of a tenth of the sample rate.
inline constexpr int kFrictionParts = 4;

template <int Masses, class T>
struct FrictionParts {
  static constexpr int kStates = Sizes<Masses>::kStates;
  LinearSystem<T, kStates> step;  ///< Over one part: a and b only.
  Eigen::Matrix<T, kStates, 1> lag_b = Eigen::Matrix<T, kStates, 1>::Zero();
  T decay = T(0.0);
  /// [part] What a torque of 1 in it does to the states at the end of the sample, and to the output.
  std::array<Eigen::Matrix<T, kStates, 1>, kFrictionParts> b;
  std::array<T, kFrictionParts> d;
  std::array<T, kFrictionParts> past_d;  ///< [part of the sample before] Of differences, beside its mean.
};

enum class Side { driven, load };

/// Of the drive that sampled_drive() describes with the same arguments, and a torque on one side of it.
template <int Masses, class T>
FrictionParts<Masses, T> friction_parts(Side side, const data::ThreeMass<T>& p, data::OutputQuantity quantity,
                                        const T& delay_samples, double sample_time_s, Lag lag,
                                        const T& lag_samples, Velocity velocity) {
  constexpr int kStates = Sizes<Masses>::kStates;
  auto continuous = continuous_drive<Masses>(p);
  if (side == Side::load && Masses > 1) {
    for (int i = 0; i < kStates; ++i) continuous.b(i) = T(0.0);
    continuous.b(Masses - 1) = T(1.0) / p.load_inertia;
  }
  const double length = sample_time_s / kFrictionParts;
  FrictionParts<Masses, T> parts;
  parts.step = hold(continuous, T(length));
  if (lag == Lag::first_order && plain(lag_samples) > 0.0) {
    const T seconds = lag_samples * T(sample_time_s);
    using std::exp;
    parts.decay = exp(-T(length) / seconds);
    parts.lag_b = decayed(continuous, seconds, T(length));
  }
  parts.b[kFrictionParts - 1] = parts.step.b;
  for (int i = kFrictionParts - 1; i > 0; --i)
    for (int row = 0; row < kStates; ++row) {
      T sum(0.0);
      for (int c = 0; c < kStates; ++c) sum += parts.step.a(row, c) * parts.b[static_cast<std::size_t>(i)](c);
      parts.b[static_cast<std::size_t>(i - 1)](row) = sum;
    }
  // The output is taken `rest` after the sample's begin.
  const int whole = static_cast<int>(std::floor(plain(delay_samples) + 1e-9));
  const T rest = (T(1.0) - (delay_samples - T(whole))) * T(sample_time_s);
  const bool differences = quantity == data::OutputQuantity::velocity && velocity == Velocity::differences;
  const int seen = differences || quantity == data::OutputQuantity::position ? kStates - 1 : 0;
  const T scale(differences ? 1.0 / sample_time_s : 1.0);
  for (int i = 0; i < kFrictionParts; ++i) {
    auto& d = parts.d[static_cast<std::size_t>(i)];
    d = parts.past_d[static_cast<std::size_t>(i)] = T(0.0);
    const T begin(i * length), end((i + 1) * length);
    if (differences && plain(rest) < plain(end)) {  // the place one sample before, looked back to
      const auto on = hold(continuous, plain(begin) < plain(rest) ? end - rest : T(length));
      const auto before = hold(continuous, rest - end);
      for (int c = 0; c < kStates; ++c)
        parts.past_d[static_cast<std::size_t>(i)] += scale * before.a(seen, c) * on.b(c);
    }
    const bool last = plain(rest) < plain(end);
    if (!(plain(begin) < plain(rest))) continue;
    const auto on = hold(continuous, last ? rest - begin : T(length));
    if (last) {
      d = scale * on.b(seen);
      continue;
    }
    const auto after = hold(continuous, rest - end);
    for (int c = 0; c < kStates; ++c) d += scale * after.a(seen, c) * on.b(c);
  }
  return parts;
}

}  // namespace resonid::fit::detail
