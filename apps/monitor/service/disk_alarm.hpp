// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "monitor/store/records.hpp"

namespace resonid::monitor {

/// The alarm `disk` of the installation: nothing can be written, or more is kept than may be and nothing is
/// left to remove. It needs nobody's acknowledgement: it is over when there is room.
class DiskAlarm {
 public:
  static constexpr const char* kName = "disk";

  /// One that a former process left open.
  void know(const AlarmRecord& record);
  /// What is so now, asked several times a second; adds to the batch what becomes of it. The alarm comes
  /// after a second, and goes after ten.
  ///
  /// @param fault why nothing can be written; empty: it can
  /// @param over_limit why too much is kept; empty: it is not
  void look(const std::string& fault, const std::string& over_limit, std::int64_t now_ns, Batch& batch);

 private:
  enum class State : std::uint8_t { well, over_limit, failing };
  void tell(const char* transition, std::string text, std::int64_t now_ns, Batch& batch);

  State state_ = State::well, next_ = State::well;
  std::int64_t next_since_ns_ = 0;
  AlarmRecord record_;  // the newest raising's
};

}  // namespace resonid::monitor
