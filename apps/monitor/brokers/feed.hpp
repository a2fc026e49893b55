// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <resonid/base/enum_names.hpp>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "monitor/samples/frame.hpp"
#include "monitor/samples/text_decoder.hpp"
#include "monitor/sources/source.hpp"

namespace resonid::monitor {

enum class PayloadFormat : std::uint8_t { frame, csv, json, line_protocol };
inline constexpr EnumName<PayloadFormat> kPayloadFormatNames[] = {
    {PayloadFormat::frame, "frame"},
    {PayloadFormat::csv, "csv"},
    {PayloadFormat::json, "json"},
    {PayloadFormat::line_protocol, "line-protocol"}};
[[nodiscard]] constexpr std::span<const EnumName<PayloadFormat>> enum_names(PayloadFormat) noexcept {
  return kPayloadFormatNames;
}

/// What is read from a broker: every message is whole, of one or more frames or lines.
struct TopicSettings {
  std::string filter;  ///< Topics or subjects, wildcards allowed; the first one-level wildcard is the axis.
  PayloadFormat format = PayloadFormat::frame;
  std::vector<std::string> columns = {};  ///< Of CSV; empty: every message begins with a line of names.
  std::string axis = {};                  ///< Where neither topic nor message names one.
};

/// How names of topics are made.
struct TopicSyntax {
  char separator = '/';
  char wildcard = '+';  ///< One level.
  char rest = '#';      ///< All levels that are left.
};
inline constexpr TopicSyntax kMqttTopics{'/', '+', '#'};
inline constexpr TopicSyntax kNatsSubjects{'.', '*', '>'};

/// The part of a topic that stands where the filter has its first one-level wildcard; nothing without one.
[[nodiscard]] std::optional<std::string_view> axis_in(std::string_view filter, std::string_view topic,
                                                      TopicSyntax syntax);

/// Reads whole messages in one format.
class MessageReader {
 public:
  MessageReader(const TopicSettings& settings, FaultLog& faults);
  void read(std::string_view payload, const std::function<void(const Arrival&)>& take);

 private:
  FaultLog& faults_;
  std::variant<FrameDecoder, TextDecoder> decoder_;
};

/// Gives the samples of messages to the intakes of their axes, and counts.
///
/// The axis is what the topic and the message tell, joined by the separator ("m1/x"), where an axis of that
/// name is configured; else what the topic tells; without wildcard what the message tells, or where it does
/// not, the whole topic, or the only one that is configured.
class Feed {
 public:
  Feed(Axes& axes, std::vector<TopicSettings> topics, TopicSyntax syntax);

  /// One message, of topics()[topic], by one thread per topic at a time. Waits while an intake is full.
  ///
  /// @param position of the message; word 3 is set here
  /// @return whether all of it was taken or is refused for good; false after stop(): it is to come again
  [[nodiscard]] bool take(std::size_t topic, std::string_view name, std::string_view payload,
                          SourcePosition position = {});
  /// What waits gives up.
  void stop() noexcept { stopping_.store(true, std::memory_order_release); }
  [[nodiscard]] bool stopping() const noexcept { return stopping_.load(std::memory_order_acquire); }

  void count_lost(std::uint64_t messages) noexcept { lost_.fetch_add(messages, std::memory_order_relaxed); }
  void count_unknown(std::string_view name, std::string_view what);
  [[nodiscard]] std::span<const TopicSettings> topics() const noexcept { return topics_; }
  [[nodiscard]] Axes& axes() const noexcept { return axes_; }
  /// Counters, and the newest fault of each kind as text.
  [[nodiscard]] SourceStatus status() const;

 private:
  using Readers = std::map<std::string, MessageReader, std::less<>>;

  [[nodiscard]] MessageReader& reader(std::size_t topic, std::string_view name, Intake* intake);
  [[nodiscard]] Intake* find(std::string_view name, std::optional<std::string_view> by_topic,
                             std::string_view by_message) const;
  [[nodiscard]] bool deliver(Intake& intake, const Arrival& arrival, const SourcePosition& position);

  Axes& axes_;
  std::vector<TopicSettings> topics_;
  TopicSyntax syntax_;
  std::vector<Readers> readers_;  ///< [topic] By name: the lines of each have their own columns.
  FaultLog faults_;
  std::atomic<bool> stopping_{false};
  std::atomic<std::uint64_t> messages_{0}, bytes_{0}, lost_{0}, unknown_{0};
};

}  // namespace resonid::monitor
