// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <resonid/online/detail/control_config.hpp>
#include <span>

namespace resonid::online {

/// Gains as a step uses them.
template <class Real>
struct StepGains {
  Real kp = Real(0);
  Real ki_ts = Real(0);  ///< ki times the sample time.
};

/// Gains over position: linear between nodes, constant beyond the ends (docs/methods/tune.md 12). Without
/// nodes it is empty. Trivially copyable; a lookup takes as many comparisons as there are nodes.
template <class Real, std::size_t Max>
class GainTable {
 public:
  /// Nodes that check_nodes() has found good.
  GainTable(std::span<const GainNode> nodes, double sample_rate_hz) noexcept {
    count_ = nodes.size() < Max ? nodes.size() : Max;
    for (std::size_t i = 0; i < count_; ++i) {
      nodes_[i].position = static_cast<Real>(nodes[i].position);
      nodes_[i].at = {static_cast<Real>(nodes[i].kp), static_cast<Real>(nodes[i].ki / sample_rate_hz)};
      if (i + 1 == count_) break;
      const double length = nodes[i + 1].position - nodes[i].position;
      nodes_[i].slope = {static_cast<Real>((nodes[i + 1].kp - nodes[i].kp) / length),
                         static_cast<Real>((nodes[i + 1].ki - nodes[i].ki) / sample_rate_hz / length)};
    }
  }

  [[nodiscard]] bool empty() const noexcept { return count_ == 0; }
  [[nodiscard]] StepGains<Real> at(Real position) const noexcept {
    std::size_t i = 0;
    while (i + 1 < count_ && position >= nodes_[i + 1].position) ++i;
    const Node& node = nodes_[i];
    const Real way = position > node.position ? position - node.position : Real(0);
    return {node.at.kp + way * node.slope.kp, node.at.ki_ts + way * node.slope.ki_ts};
  }
  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept { return count_ <= Max; }

 private:
  struct Node {
    Real position = Real(0);
    StepGains<Real> at{}, slope{};  // slope: up to the next node, 0 beyond the last
  };
  std::array<Node, Max> nodes_{};
  std::size_t count_ = 0;
};

}  // namespace resonid::online
