// SPDX-License-Identifier: MIT
#pragma once

#include <ceres/jet.h>

#include <array>
#include <fit/drive/drive_simulation.hpp>
#include <span>
#include <type_traits>

namespace resonid::fit::detail {

// `Row`: Slopes.

/// Parts of a sample in which friction acts on one side, with their slopes.
template <int Masses, class Row>
struct PartsSlopes {
  static constexpr std::size_t kStates = Sizes<Masses>::kStates;
  FrictionParts<Masses, double> parts;
  std::array<std::array<Row, kStates>, kFrictionParts> b;
  std::array<Row, kFrictionParts> d, past_d;

  /// Column `to` from the derivatives by parameter `from`.
  template <class Jets>
  void take(const Jets& jets, int from, Eigen::Index to) {
    for (std::size_t part = 0; part < kFrictionParts; ++part) {
      for (std::size_t i = 0; i < kStates; ++i)
        b[part][i].set(to, jets.b[part](static_cast<Eigen::Index>(i)).v(from));
      d[part].set(to, jets.d[part].v(from));
      past_d[part].set(to, jets.past_d[part].v(from));
    }
  }
};

/// Sides on which friction acts in parts of a sample.
struct InParts {
  bool driven = false, load = false;
};

/// The sampled drive with the slopes of its matrices.
template <int Masses, class Row>
struct SampledSlopes {
  static constexpr int kStates = Sizes<Masses>::kStates;
  SampledDrive<Masses, double> drive;
  std::array<std::array<Row, kStates>, kStates> a;
  std::array<Row, kStates> b, c, lag_b;
  Row d, lag_d, decay, past_d;
  PartsSlopes<Masses, Row> driven, load;  ///< With dry friction there only.
};

template <int Masses, class Row>
SampledSlopes<Masses, Row> sampled(const SimulationSetup& setup, const double* x, std::span<const int> active,
                                   InParts dry) {
  constexpr int kStates = Sizes<Masses>::kStates, kCount = Sizes<Masses>::kParameters;
  SampledSlopes<Masses, Row> result;
  const auto with = [&](const auto* coordinates, auto&& make) {
    using T = std::decay_t<decltype(*coordinates)>;
    return make(setup.coordinates.parameters(coordinates, Masses == 3), setup.quantity,
                T(coordinates[kDelay] + T(setup.known_delay_samples)), setup.coordinates.sample_time_s,
                setup.lag, coordinates[kTorqueLag], setup.velocity);
  };
  const auto of = [&](const auto* x_or_jets) {
    return with(x_or_jets, [&](const auto&... a) { return sampled_drive<Masses>(a..., setup.mass); });
  };
  const auto parts_of = [&](const auto* x_or_jets, Side side) {
    return with(x_or_jets, [side](const auto&... a) { return friction_parts<Masses>(side, a...); });
  };
  result.drive = of(x);
  if (dry.driven) result.driven.parts = parts_of(x, Side::driven);
  if (dry.load) result.load.parts = parts_of(x, Side::load);
  if constexpr (Row::kColumns > 0) {
    if (active.empty() || active.front() >= kCount) return result;
    using Jet = ceres::Jet<double, kCount>;
    std::array<Jet, kCount> jets;
    for (int i = 0; i < kCount; ++i) jets[static_cast<std::size_t>(i)] = Jet(x[i]);
    for (const int p : active)
      if (p < kCount) jets[static_cast<std::size_t>(p)].v(p) = 1.0;
    const auto jet = of(jets.data());
    const auto& s = jet.system;
    for (std::size_t p = 0; p < active.size(); ++p) {
      const int from = active[p];
      if (from >= kCount) continue;
      const auto to = static_cast<Eigen::Index>(p);
      for (int i = 0; i < kStates; ++i) {
        const auto row = static_cast<std::size_t>(i);
        for (int j = 0; j < kStates; ++j)
          result.a[row][static_cast<std::size_t>(j)].set(to, s.a(i, j).v(from));
        result.b[row].set(to, s.b(i).v(from));
        result.c[row].set(to, s.c(i).v(from));
        result.lag_b[row].set(to, jet.lag_b(i).v(from));
      }
      result.d.set(to, s.d.v(from));
      result.lag_d.set(to, jet.lag_d.v(from));
      result.decay.set(to, jet.decay.v(from));
      result.past_d.set(to, jet.past_d.v(from));
    }
    const auto add_parts = [&](Side side, PartsSlopes<Masses, Row>& parts) {
      const auto jet_parts = parts_of(jets.data(), side);
      for (std::size_t p = 0; p < active.size(); ++p)
        if (active[p] < kCount) parts.take(jet_parts, active[p], static_cast<Eigen::Index>(p));
    };
    if (dry.driven) add_parts(Side::driven, result.driven);
    if (dry.load) add_parts(Side::load, result.load);
  }
  return result;
}

}  // namespace resonid::fit::detail
