// SPDX-License-Identifier: MIT
#include "monitor/brokers/feed.hpp"

#include <fmt/core.h>

#include <chrono>
#include <thread>

namespace resonid::monitor {
namespace {

constexpr std::size_t kMostDecoders = 1024;  // names of topics are the sender's: they may be endless
constexpr auto kFullWait = std::chrono::milliseconds(2);

std::string_view next_level(std::string_view& text, char separator) {
  const std::size_t end = text.find(separator);
  const std::string_view level = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  return level;
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

Feed::Feed(Delivery& delivery, std::vector<TopicSettings> topics, TopicSyntax syntax)
    : delivery_(delivery), topics_(std::move(topics)), syntax_(syntax), decoders_(topics_.size()) {}

Intake* Feed::find(std::string_view name, std::optional<std::string_view> by_topic,
                   std::string_view by_message) const {
  Axes& axes = delivery_.axes();
  if (by_topic && !by_message.empty())
    if (Intake* both = axes.find(fmt::format("{}{}{}", *by_topic, syntax_.separator, by_message)))
      return both;
  if (by_topic) return axes.find(*by_topic);
  if (!by_message.empty()) return axes.find(by_message);
  if (Intake* const named = axes.find(name)) return named;
  return delivery_.find({});
}

void Feed::count_unknown(std::string_view name, std::string_view what) {
  delivery_.count_unknown(fmt::format("'{}' {}", printable(name), what));
}

bool Feed::deliver(Intake& intake, const Arrival& arrival, const SourcePosition& position,
                   std::string_view name) {
  std::optional<Delivery::Wait> waiting;
  while (intake.add(arrival, position) == Intake::Outcome::full) {
    if (delivery_.stopping()) return false;
    if (!waiting) waiting.emplace(delivery_, name);
    std::this_thread::sleep_for(kFullWait);
  }
  return true;
}

bool Feed::take(std::size_t topic, std::string_view name, std::string_view payload, SourcePosition position) {
  delivery_.count_message();
  delivery_.count_bytes(payload.size());
  const TopicSettings& settings = topics_[topic];
  const auto by_topic = axis_in(settings.filter, name, syntax_);
  Intake* const of_topic = by_topic ? delivery_.axes().find(*by_topic) : nullptr;
  bool unknown = false, taken = true;
  bool used = of_topic != nullptr || (!by_topic && find(name, by_topic, settings.format.axis) != nullptr);
  Decoders &kept = decoders_[topic], fresh;
  auto decoder = kept.find(name);
  if (decoder == kept.end())  // faults of lines go to the axis where the topic tells it
    decoder = fresh.try_emplace(std::string(name), settings.format, faults(of_topic)).first;
  decoder->second.message(payload, [&](const Message& message) {
    const auto* arrival = std::get_if<Arrival>(&message);
    if (arrival == nullptr)
      return faults(of_topic).note(Fault::format,
                                   "a question or an acknowledgement; a frame of samples is required");
    if (!taken) return;
    Intake* const intake = find(name, by_topic, arrival->axis.empty() ? settings.format.axis : arrival->axis);
    if (position.told()) ++position.word[3];  // frames are counted; lines tell their bytes
    used = used || intake != nullptr;
    if (intake != nullptr) {
      taken = deliver(*intake, *arrival, position, name);
    } else if (!std::exchange(unknown, true)) {
      count_unknown(name, fmt::format("tells of axis '{}', which is not configured",
                                      printable(by_topic ? *by_topic : arrival->axis)));
    }
  });
  if (fresh.empty() || !used) return taken;
  if (kept.size() >= kMostDecoders) kept.clear();
  kept.merge(fresh);
  return taken;
}

}  // namespace resonid::monitor
