// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "monitor/sources/decoder.hpp"
#include "monitor/sources/delivery.hpp"

namespace resonid::monitor {

/// What is read from a broker: every message is whole, of one or more frames or lines.
struct TopicSettings {
  std::string filter;  ///< Topics or subjects, wildcards allowed; the first one-level wildcard is the axis.
  Format format = {SampleFormat::frame};  ///< CSV without columns: every message begins with their names.
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

/// Gives the samples of messages to the intakes of their axes, and has them counted.
///
/// The axis is what the topic and the message tell, joined by the separator ("m1/x"), where an axis of that
/// name is configured; else what the topic tells; without wildcard what the message tells, or where it does
/// not, the whole topic, or the only one that is configured.
class Feed {
 public:
  Feed(Delivery& delivery, std::vector<TopicSettings> topics, TopicSyntax syntax);

  /// One message, of topics()[topic], by one thread per topic at a time. Waits while an intake is full.
  ///
  /// @param position of the message; word 3 is set here
  /// @return whether all of it was taken or is refused for good; false once the delivery is to stop: it is to
  /// come again
  [[nodiscard]] bool take(std::size_t topic, std::string_view name, std::string_view payload,
                          SourcePosition position = {});
  void count_unknown(std::string_view name, std::string_view what);
  [[nodiscard]] std::span<const TopicSettings> topics() const noexcept { return topics_; }

 private:
  using Decoders = std::map<std::string, Decoder, std::less<>>;

  [[nodiscard]] FaultLog& faults(Intake* intake) const {
    return intake != nullptr ? intake->faults() : delivery_.faults_of_none();
  }
  [[nodiscard]] Intake* find(std::string_view name, std::optional<std::string_view> by_topic,
                             std::string_view by_message) const;
  [[nodiscard]] bool deliver(Intake& intake, const Arrival& arrival, const SourcePosition& position,
                             std::string_view name);

  Delivery& delivery_;
  std::vector<TopicSettings> topics_;
  TopicSyntax syntax_;
  std::vector<Decoders> decoders_;  ///< [topic] By name, of those that an axis has: the lines of each have
                                    ///< their own columns.
};

}  // namespace resonid::monitor
