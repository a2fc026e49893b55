// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "monitor/web/backend.hpp"

namespace resonid::monitor::web {

/// One Server-Sent Event, made once and sent by every stream that wants it.
using Text = std::shared_ptr<const std::string>;
struct FeedEvent {
  enum class Kind : std::uint8_t {
    frame,     ///< Of all axes: for every stream; the newest takes the place of one that waits.
    axis,      ///< Of one axis, likewise.
    response,  ///< Of one axis, likewise.
    alarm,     ///< For every stream, and never left out.
  };
  Kind kind = Kind::frame;
  std::string axis;  ///< For streams of this axis only; empty: for all.
  std::uint64_t id = 0;
  Text text;
};

/// Makes the events of all streams. A frame has those axes that changed, those first that were not in one for
/// longest, up to kFrameBytes; every axis comes again within kRefresh rounds, so that a client that missed
/// frames is right again by itself. Ids are BOOT-COUNT: after a restart no client is taken for an old one.
class Feed {
 public:
  static constexpr std::size_t kFrameBytes = 32'000;
  static constexpr std::uint64_t kRefresh = 40;        ///< Rounds; 2 s at 20 per second.
  static constexpr std::uint64_t kResponseRounds = 5;  ///< At most every fifth round brings a response.
  static constexpr std::size_t kRemembered = 200;  ///< Alarm events to resume from; who lacks more asks anew.

  /// `send` is called with each event, in the order of their ids, under a lock: it must not wait.
  Feed(const Backend& backend, std::uint64_t boot, std::function<void(FeedEvent)> send);

  /// One round, by one thread at a time: the frame, and what is new of the axes that streams watch.
  void round(double now_s, const std::set<std::string>& watched);

  /// A transition of an alarm; from any thread.
  void alarm(const Alarm&);

  /// What a stream begins with: an event `hello` {"resumed", "time_s"}, and if the id (empty: none) is one
  /// that can be resumed from, the alarm events after it.
  struct Beginning {
    std::vector<Text> texts;
    std::uint64_t id = 0;  ///< Everything up to it is in there.
  };
  [[nodiscard]] Beginning begin(std::string_view last_event_id, double now_s) const;

  [[nodiscard]] std::uint64_t frames() const;

 private:
  struct Entry {
    AxisStatus status;
    bool changed = true;
    std::uint64_t sent = 0;  ///< Round in which it was in a frame; 0: in none.
  };
  void look(std::uint64_t after);
  [[nodiscard]] std::string frame(double now_s);
  [[nodiscard]] std::string event(std::uint64_t id, std::string_view name, std::string_view data) const;
  void publish(FeedEvent::Kind kind, std::string axis, std::string_view name, std::string_view data);

  const Backend& backend_;
  std::uint64_t boot_;
  std::function<void(FeedEvent)> send_;

  // The thread of round() alone.
  std::map<std::string, Entry> axes_;
  std::map<std::string, double> responses_;  ///< Time of the newest that was sent.
  std::uint64_t revision_ = 0, round_ = 0;

  mutable std::mutex mutex_;
  std::uint64_t last_id_ = 0, frames_ = 0;
  std::uint64_t forgotten_ = 0;  ///< Newest alarm event that is no longer in the ring.
  std::deque<FeedEvent> ring_;
};

}  // namespace resonid::monitor::web
