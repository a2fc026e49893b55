// SPDX-License-Identifier: MIT
#include "monitor/web/feed.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <utility>

#include "monitor/web/api_json.hpp"
#include "monitor/web/questions.hpp"

namespace resonid::monitor::web {

Feed::Feed(const Backend& backend, std::uint64_t boot, std::function<void(FeedEvent)> send)
    : backend_(backend), boot_(boot), send_(std::move(send)) {}

std::string Feed::event(std::uint64_t id, std::string_view name, std::string_view data) const {
  return fmt::format("id: {:x}-{}\nevent: {}\ndata: {}\n\n", boot_, id, name, data);
}

void Feed::publish(FeedEvent::Kind kind, std::string axis, std::string_view name, std::string_view data) {
  const std::lock_guard lock(mutex_);
  const auto id = ++last_id_;
  FeedEvent made{kind, std::move(axis), id, std::make_shared<const std::string>(event(id, name, data))};
  frames_ += kind == FeedEvent::Kind::frame;
  if (kind == FeedEvent::Kind::alarm) {
    ring_.push_back(made);
    if (ring_.size() > kRemembered) {
      forgotten_ = ring_.front().id;
      ring_.pop_front();
    }
  }
  send_(std::move(made));
}

void Feed::alarm(const Alarm& alarm) { publish(FeedEvent::Kind::alarm, {}, "alarm", alarm_json(alarm)); }

std::uint64_t Feed::frames() const {
  const std::lock_guard lock(mutex_);
  return frames_;
}

Feed::Beginning Feed::begin(std::string_view last_event_id, double now_s) const {
  std::uint64_t boot = 0, after = 0;
  const auto* const end = last_event_id.data() + last_event_id.size();
  bool known = false;
  if (const auto first = std::from_chars(last_event_id.data(), end, boot, 16);
      first.ec == std::errc{} && first.ptr != end && *first.ptr == '-' && boot == boot_) {
    const auto second = std::from_chars(first.ptr + 1, end, after);
    known = second.ec == std::errc{} && second.ptr == end;
  }

  const std::lock_guard lock(mutex_);
  const bool resumed = known && after >= forgotten_ && after <= last_id_;
  Beginning beginning;
  beginning.id = last_id_;
  if (resumed)
    for (const auto& remembered : ring_)
      if (remembered.id > after) beginning.texts.push_back(remembered.text);
  // Last, so that its id does not tell a client whose connection breaks here that it has what comes before.
  beginning.texts.push_back(std::make_shared<const std::string>(
      event(last_id_, "hello", fmt::format(R"({{"resumed":{},"time_s":{}}})", resumed, now_s))));
  return beginning;
}

void Feed::look(std::uint64_t after) {
  auto news = backend_.axes(after);
  if (after == 0)  // all of them: what is not among them has gone
    std::erase_if(axes_, [&](const auto& entry) {
      return std::none_of(news.axes.begin(), news.axes.end(),
                          [&](const auto& axis) { return axis.name == entry.first; });
    });
  for (auto& axis : news.axes) {
    if (!is_axis_name(axis.name)) continue;  // stands unescaped in a frame
    auto& entry = axes_[axis.name];
    entry.changed = entry.changed || after != 0;
    entry.status = std::move(axis);
  }
  if (after != 0 || round_ == 1) revision_ = news.revision;
}

std::string Feed::frame(double now_s) {
  std::vector<std::pair<std::uint64_t, const std::string*>> waiting;
  for (const auto& [name, entry] : axes_)
    if (entry.changed || round_ - entry.sent >= kRefresh) waiting.emplace_back(entry.sent, &name);
  std::stable_sort(waiting.begin(), waiting.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::string text = fmt::format(R"({{"time_s":{},"axes":{{)", now_s);
  bool first = true;
  for (const auto& [sent, name] : waiting) {
    if (text.size() > kFrameBytes) break;
    auto& entry = axes_[*name];
    text += fmt::format(R"({}"{}":{})", first ? "" : ",", *name, status_short_json(entry.status));
    first = false;
    entry.changed = false;
    entry.sent = round_;
  }
  return first ? std::string() : text + "}}";
}

void Feed::round(double now_s, const std::set<std::string>& watched) {
  ++round_;
  if (round_ > 1) look(revision_);
  if (round_ % kRefresh == 1) look(0);
  std::vector<const AxisStatus*> shown;
  for (const auto& name : watched)
    if (const auto found = axes_.find(name); found != axes_.end() && found->second.changed)
      shown.push_back(&found->second.status);
  if (const auto data = frame(now_s); !data.empty()) publish(FeedEvent::Kind::frame, {}, "frame", data);
  for (const auto* status : shown)
    publish(FeedEvent::Kind::axis, status->name, "axis", status_full_json(*status));
  if (round_ % kResponseRounds != 0) return;
  std::erase_if(responses_, [&](const auto& known) { return !watched.contains(known.first); });
  for (const auto& name : watched) {
    const auto response = backend_.response(name);
    if (!response) continue;
    const auto [known, is_new] = responses_.try_emplace(name, response->time_s);
    if (!is_new && known->second == response->time_s) continue;
    known->second = response->time_s;
    publish(FeedEvent::Kind::response, name, "response", response_json(name, *response));
  }
}

}  // namespace resonid::monitor::web
