// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <resonid/base/enum_names.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "monitor/samples/intake.hpp"

namespace resonid::monitor {

enum class SourceState : std::uint8_t {
  starting,
  running,
  waiting,  ///< For the other side, which is tried again.
  ended,    ///< There is no more (a pipe that was closed).
  failed,   ///< For good.
};
inline constexpr EnumName<SourceState> kSourceStateNames[] = {{SourceState::starting, "starting"},
                                                              {SourceState::running, "running"},
                                                              {SourceState::waiting, "waiting"},
                                                              {SourceState::ended, "ended"},
                                                              {SourceState::failed, "failed"}};
[[nodiscard]] constexpr std::span<const EnumName<SourceState>> enum_names(SourceState) noexcept {
  return kSourceStateNames;
}

/// So many axes that nobody configured are told one by one: a sender may make up names for ever.
inline constexpr std::size_t kMostFirstUnknown = 10;

/// What is known of a source since it was started.
struct SourceStatus {
  SourceState state = SourceState::starting;
  std::uint64_t messages = 0, bytes = 0;
  std::uint64_t lost = 0;                  ///< Messages that the source knows to have been lost.
  std::uint64_t unknown = 0;               ///< Messages of axes that nobody configured.
  std::vector<std::string> first_unknown;  ///< What they were, each once; kMostFirstUnknown at most.
  /// [kind] What was wrong and belongs to no axis; of one that has an axis alone they are that one's.
  std::array<std::uint64_t, kFaults> faults{};
  std::string text;  ///< Why it waits or failed; the newest fault.
};

/// Where the samples of a source go.
class Axes {
 public:
  virtual ~Axes() = default;
  /// The intake of what the source calls so; nothing where no axis is configured for it. For any thread; the
  /// intake lives as long as the source.
  [[nodiscard]] virtual Intake* find(std::string_view name) = 0;
  /// All of this source's, for a source that must resume (Ring::source()) or that has one axis alone.
  [[nodiscard]] virtual std::span<Intake* const> all() = 0;
};

/// Brings samples from somewhere into the intakes of its axes, on threads of its own.
///
/// A source that can be asked again waits while an intake is `full`, and lets the other side go on only with
/// what is in the ring; one that cannot counts what it drops as lost.
class Source {
 public:
  virtual ~Source() = default;
  /// Once. What cannot be had now is tried again, and told by status().
  virtual void start() = 0;
  /// Ends its threads; what was taken is in the rings. For any thread; more than once is once.
  virtual void stop() = 0;
  [[nodiscard]] virtual SourceStatus status() const = 0;
  /// What it can lose when the process is killed, in a sentence.
  [[nodiscard]] virtual std::string_view promise() const noexcept = 0;
};

}  // namespace resonid::monitor
