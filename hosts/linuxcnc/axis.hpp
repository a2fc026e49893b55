// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <resonid/base/expected.hpp>
#include <resonid/online/axis.hpp>
#include <type_traits>

#include "core.h"

namespace resonid::linuxcnc {

/// One axis of a machine in its servo thread: the library's axis at evenly spaced lines, in the words of the
/// component.
///
/// The work of a row is spread over a turn of the lines, one line per period: a turn takes lines + 2 periods.
/// The loop is measured, L = Ru/U - 1, or that of a pid's gains. Rows are made while the excitation is
/// steady; what was found stays. Trivially copyable, no heap.
class Axis {
 public:
  static expected<Axis, Error> create(const resonid_axis_shape& shape);

  [[nodiscard]] double excite(const resonid_axis_settings& settings,
                              const resonid_axis_sample& sample) noexcept;
  void identify(const resonid_axis_settings& settings, const resonid_axis_sample& sample) noexcept;
  [[nodiscard]] const resonid_axis_results& results() const noexcept { return results_; }

 private:
  struct Room : online::AxisRoom {
    static constexpr std::size_t kInjectedLines = RESONID_MAX_LINES, kBaselinePoints = 0, kChangeWindow = 0;
    static constexpr bool kControllerCheck = false;
  };
  using Engine = online::BasicAxis<Room, online::AxisLines<double, RESONID_MAX_LINES>>;

  Axis(const resonid_axis_shape& shape, const Engine& engine) noexcept;

  void start(const resonid_axis_settings& settings) noexcept;
  void follow(const resonid_axis_settings& settings) noexcept;
  void take_row() noexcept;
  [[nodiscard]] resonid_trust verdict() const noexcept;
  void forget() noexcept;

  resonid_axis_shape shape_;
  Engine engine_;
  resonid_axis_results results_{};
  resonid_axis_settings followed_{};  // whose loop the margins are of
  bool was_enabled_ = false, was_reset_ = false;
};

static_assert(std::is_trivially_copyable_v<Axis>);

}  // namespace resonid::linuxcnc
