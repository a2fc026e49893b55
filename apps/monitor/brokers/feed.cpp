// SPDX-License-Identifier: MIT
#include "monitor/brokers/feed.hpp"

#include <fmt/core.h>

#include <chrono>
#include <thread>

namespace resonid::monitor {
namespace {

constexpr std::size_t kMostReaders = 10'000;  // names of topics are the sender's: they may be endless
constexpr auto kFullWait = std::chrono::milliseconds(2);

std::string_view next_level(std::string_view& text, char separator) {
  const std::size_t end = text.find(separator);
  const std::string_view level = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  return level;
}

TextFormat text_format(PayloadFormat format) {
  switch (format) {
    case PayloadFormat::json:
      return TextFormat::json;
    case PayloadFormat::line_protocol:
      return TextFormat::line_protocol;
    case PayloadFormat::frame:
    case PayloadFormat::csv:
      break;
  }
  return TextFormat::csv;
}

std::variant<FrameDecoder, TextDecoder> decoder_of(const TopicSettings& settings, FaultLog& faults) {
  if (settings.format == PayloadFormat::frame) return FrameDecoder(faults);
  return TextDecoder({text_format(settings.format), settings.columns, settings.axis}, faults);
}

}  // namespace

std::optional<std::string_view> axis_in(std::string_view filter, std::string_view topic, TopicSyntax syntax) {
  while (!filter.empty()) {
    const std::string_view pattern = next_level(filter, syntax.separator);
    const std::string_view level = next_level(topic, syntax.separator);
    if (pattern == std::string_view(&syntax.wildcard, 1)) return level;
    if (pattern == std::string_view(&syntax.rest, 1)) break;
  }
  return std::nullopt;
}

MessageReader::MessageReader(const TopicSettings& settings, FaultLog& faults)
    : faults_(faults), decoder_(decoder_of(settings, faults)) {}

void MessageReader::read(std::string_view payload, const std::function<void(const Arrival&)>& take) {
  if (auto* text = std::get_if<TextDecoder>(&decoder_)) return text->message(payload, take);
  auto& frames = std::get<FrameDecoder>(decoder_);
  frames.add(payload, [&](const Message& message) {
    if (const auto* arrival = std::get_if<Arrival>(&message)) return take(*arrival);
    faults_.note(Fault::format, "a question or an acknowledgement; a frame of samples is required");
  });
  frames.finish();
}

Feed::Feed(Axes& axes, std::vector<TopicSettings> topics, TopicSyntax syntax)
    : axes_(axes), topics_(std::move(topics)), syntax_(syntax), readers_(topics_.size()) {}

/// Faults of lines go to the axis where the topic tells it.
MessageReader& Feed::reader(std::size_t topic, std::string_view name, Intake* intake) {
  Readers& readers = readers_[topic];
  if (const auto found = readers.find(name); found != readers.end()) return found->second;
  if (readers.size() >= kMostReaders) readers.clear();
  return readers
      .try_emplace(std::string(name), topics_[topic], intake != nullptr ? intake->faults() : faults_)
      .first->second;
}

Intake* Feed::find(std::string_view name, std::optional<std::string_view> by_topic,
                   std::string_view by_message) const {
  if (by_topic && !by_message.empty())
    if (Intake* both = axes_.find(fmt::format("{}{}{}", *by_topic, syntax_.separator, by_message)))
      return both;
  if (by_topic) return axes_.find(*by_topic);
  if (!by_message.empty()) return axes_.find(by_message);
  if (Intake* const named = axes_.find(name)) return named;
  return axes_.all().size() == 1 ? axes_.all().front() : nullptr;
}

void Feed::count_unknown(std::string_view name, std::string_view what) {
  unknown_.fetch_add(1, std::memory_order_relaxed);
  faults_.note(Fault::axis, fmt::format("'{}' {}", printable(name), what));
}

bool Feed::deliver(Intake& intake, const Arrival& arrival, const SourcePosition& position) {
  while (intake.add(arrival, position) == Intake::Outcome::full) {
    if (stopping()) return false;
    std::this_thread::sleep_for(kFullWait);
  }
  return true;
}

bool Feed::take(std::size_t topic, std::string_view name, std::string_view payload, SourcePosition position) {
  messages_.fetch_add(1, std::memory_order_relaxed);
  bytes_.fetch_add(payload.size(), std::memory_order_relaxed);
  const TopicSettings& settings = topics_[topic];
  const auto by_topic = axis_in(settings.filter, name, syntax_);
  Intake* const of_topic = by_topic ? axes_.find(*by_topic) : nullptr;
  bool unknown = false, taken = true;
  reader(topic, name, of_topic).read(payload, [&](const Arrival& arrival) {
    if (!taken) return;
    Intake* const intake = find(name, by_topic, arrival.axis.empty() ? settings.axis : arrival.axis);
    if (position.told()) ++position.word[3];  // frames are counted; lines tell their bytes
    if (intake != nullptr) {
      taken = deliver(*intake, arrival, position);
    } else if (!std::exchange(unknown, true)) {
      count_unknown(name, fmt::format("tells of axis '{}', which is not configured",
                                      printable(by_topic ? *by_topic : arrival.axis)));
    }
  });
  return taken;
}

SourceStatus Feed::status() const {
  SourceStatus status;
  status.messages = messages_.load(std::memory_order_relaxed);
  status.bytes = bytes_.load(std::memory_order_relaxed);
  status.lost = lost_.load(std::memory_order_relaxed);
  status.unknown = unknown_.load(std::memory_order_relaxed);
  for (const auto& [kind, name] : kFaultNames)
    if (const auto count = status.faults[static_cast<std::size_t>(kind)] = faults_.count(kind); count > 0)
      status.text += fmt::format("{}{}: {} ({} times)", status.text.empty() ? "" : "; ", name,
                                 faults_.example(kind), count);
  return status;
}

}  // namespace resonid::monitor
