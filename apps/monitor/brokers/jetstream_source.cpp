// SPDX-License-Identifier: MIT
#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>
#include <vector>

#include "monitor/brokers/broker_source.hpp"
#include "monitor/brokers/jetstream_pull.hpp"
#include "monitor/brokers/nats_handles.hpp"
#include "monitor/brokers/nats_source.hpp"
#include "monitor/brokers/nats_subject.hpp"

namespace resonid::monitor {
namespace {

constexpr std::int64_t kRequest_ms = 2000;
constexpr std::int64_t kAckWait_ns = 2'000'000'000;
constexpr double kLook_s = 0.05;                  // whether the connection is there again
constexpr auto kCheck = std::chrono::seconds(1);  // whether the stream is still the one that it was
constexpr int kMostBatch = 10'000;

/// A durable consumer gives messages again that were not acknowledged, but after newer ones: whoever goes by
/// the newest sequence that he has would lose them. So whenever deliveries may have been missed (at the
/// beginning, after a reconnection, when their count has a gap) all that are not acknowledged are read from
/// the stream first, in their order. From there on all before `last_` is in the rings.
class JetStreamSource final : public BrokerSource {
 public:
  JetStreamSource(JetStreamSourceSettings settings, Axes& axes)
      : BrokerSource(axes, {settings.subjects}, kNatsSubjects), settings_(std::move(settings)) {}
  ~JetStreamSource() override { JetStreamSource::stop(); }

  [[nodiscard]] std::string_view promise() const noexcept override {
    return "Nothing is lost, as long as the stream keeps what is not yet acknowledged; nothing comes twice.";
  }

 private:
  [[nodiscard]] std::string serve() override {
    std::optional<JetStreamPull> pull;  // goes after the connection: see NatsSubscription
    const auto connection = NatsConnection::open(settings_.servers);
    if (!connection)
      return fmt::format("{}: {}", connection.error().where.view(), connection.error().requirement.view());
    JetStreamHandle handle;
    jsOptions options;
    jsOptions_Init(&options);
    options.Wait = kRequest_ms;
    const natsStatus status = nats_read(
        handle, [&](jsCtx** raw) { return natsConnection_JetStream(raw, (*connection)->get(), &options); });
    if (status != NATS_OK) return nats_text(status);
    js_ = handle.get();
    std::string why = settle(true);
    if (why.empty()) {
      pull.emplace((*connection)->get(), settings_.stream, settings_.consumer, settings_.batch);
      why = pull->status() == NATS_OK ? follow(**connection, *pull) : nats_text(pull->status());
    }
    js_ = nullptr;
    return why;
  }

  [[nodiscard]] std::string follow(NatsConnection& connection, JetStreamPull& pull) {
    set_state(SourceState::running);
    std::uint64_t reconnects = connection.reconnects();
    auto checked = std::chrono::steady_clock::now();
    while (!stopping()) {
      if (connection.closed()) return "the server has closed the connection";
      if (!connection.connected()) {
        set_state(SourceState::waiting, "no server answers");
        static_cast<void>(wait(kLook_s));
        continue;
      }
      if (const auto now_reconnects = connection.reconnects(); now_reconnects != reconnects) {
        if (std::string why = settle(false); !why.empty()) return why;
        reconnects = now_reconnects;
        pull.ask_again();
        set_state(SourceState::running);
      }
      NatsMessage message;
      if (std::string why = pull.next(message); !why.empty()) {
        if (connection.connected()) return why;
        continue;
      }
      const auto now = std::chrono::steady_clock::now();
      if (message) {
        if (std::string why = take(pull, message.get()); !why.empty()) return why;
        checked = now;
      } else if (now - checked > kCheck && connection.connected()) {
        checked = now;
        if (std::string why = changed(); !why.empty()) return why;
      }
    }
    return {};
  }

  [[nodiscard]] std::string take(const JetStreamPull& pull, natsMsg* message) {
    MessageData data;
    if (const natsStatus status =
            nats_read(data, [&](jsMsgMetaData** raw) { return natsMsg_GetMetaData(raw, message); });
        status != NATS_OK)
      return nats_text(status);
    if (data->Sequence.Consumer > due_)
      if (std::string why = settle(false); !why.empty() || stopping()) return why;
    due_ = data->Sequence.Consumer + 1;
    if (data->Sequence.Stream > last_) {
      if (settings_.subjects.filter.empty()) delivery_.count_lost(data->Sequence.Stream - last_ - 1);
      if (!give(message, data->Sequence.Stream)) return {};
      last_ = data->Sequence.Stream;
    }
    pull.acknowledge(message);
    return {};
  }

  [[nodiscard]] bool give(natsMsg* message, std::uint64_t sequence) {
    return feed_.take(0, natsMsg_GetSubject(message), payload_of(message), {{created_, 0, sequence, 0}});
  }

  /// Reads what was delivered and not acknowledged, and finds out what comes next.
  ///
  /// @param at_begin whether this is a new connection, for which the consumer is made where there is none
  /// @return why not; empty if so, or where the source is to stop, halfway
  [[nodiscard]] std::string settle(bool at_begin) {
    StreamInfo before, after;
    if (std::string why = read_stream(before); !why.empty()) return why;
    created_ = static_cast<std::uint64_t>(before->Created);
    ConsumerInfo consumer;
    if (std::string why = read_consumer(consumer, at_begin); !why.empty()) return why;
    if (std::string why = read_stream(after); !why.empty()) return why;
    if (after->Created != before->Created) return "the stream was made anew";
    // What the stream had dropped before it was read for the first time is nobody's loss.
    const bool first = std::exchange(made_, false) && before->State.FirstSeq > 0;
    if (at_begin) last_ = newest_known().value_or(first ? before->State.FirstSeq - 1 : 0);
    const std::uint64_t delivered = consumer->Delivered.Stream;
    const std::uint64_t from = std::max(consumer->AckFloor.Stream, last_) + 1;
    if (consumer->NumAckPending > 0)
      for (std::uint64_t sequence = std::max(from, after->State.FirstSeq); sequence <= delivered; ++sequence)
        if (std::string why = read_again(sequence); !why.empty() || stopping()) return why;
    last_ = std::max(last_, delivered);
    due_ = consumer->Delivered.Consumer + 1;
    return {};
  }

  [[nodiscard]] std::string read_again(std::uint64_t sequence) {
    NatsMessage message;
    jsErrCode code{};
    const natsStatus status = nats_read(message, [&](natsMsg** raw) {
      return js_GetMsg(raw, js_, settings_.stream.c_str(), sequence, nullptr, &code);
    });
    if (code == JSNoMessageFoundErr) return {};
    if (status != NATS_OK) return nats_text(status);
    if (subject_matches(settings_.subjects.filter, natsMsg_GetSubject(message.get())))
      static_cast<void>(give(message.get(), sequence));
    return {};
  }

  [[nodiscard]] std::string read_stream(StreamInfo& info) const {
    jsErrCode code{};
    const natsStatus status = nats_read(info, [&](jsStreamInfo** raw) {
      return js_GetStreamInfo(raw, js_, settings_.stream.c_str(), nullptr, &code);
    });
    if (status == NATS_OK) return {};
    if (code == JSStreamNotFoundErr) return fmt::format("there is no stream '{}'", settings_.stream);
    return fmt::format("stream '{}': {}", settings_.stream, nats_text(status));
  }

  [[nodiscard]] std::string read_consumer(ConsumerInfo& info, bool make) {
    jsErrCode code{};
    natsStatus status = nats_read(info, [&](jsConsumerInfo** raw) {
      return js_GetConsumerInfo(raw, js_, settings_.stream.c_str(), settings_.consumer.c_str(), nullptr,
                                &code);
    });
    if (status != NATS_OK && code == JSConsumerNotFoundErr && make) {
      status = make_consumer(info);
      made_ = status == NATS_OK;
    }
    if (status != NATS_OK) return fmt::format("consumer '{}': {}", settings_.consumer, nats_text(status));
    const jsConsumerConfig& found = *info->Config;
    const std::string_view filter = found.FilterSubject == nullptr ? "" : found.FilterSubject;
    if (found.AckPolicy != js_AckExplicit ||
        (found.DeliverSubject != nullptr && *found.DeliverSubject != '\0') ||
        filter != settings_.subjects.filter)
      return fmt::format(
          "consumer '{}' has filter '{}'; a pull consumer with explicit acknowledgement and filter '{}' "
          "is required",
          settings_.consumer, filter, settings_.subjects.filter);
    return {};
  }

  [[nodiscard]] natsStatus make_consumer(ConsumerInfo& info) const {
    jsConsumerConfig config;
    jsConsumerConfig_Init(&config);
    config.Durable = settings_.consumer.c_str();
    config.AckPolicy = js_AckExplicit;
    config.AckWait = kAckWait_ns;
    config.MaxAckPending = std::max<std::int64_t>(1000, 16 * settings_.batch);
    if (!settings_.subjects.filter.empty()) config.FilterSubject = settings_.subjects.filter.c_str();
    if (const std::uint64_t newest = newest_known().value_or(0); newest > 0) {
      config.DeliverPolicy = js_DeliverByStartSequence;
      config.OptStartSeq = newest + 1;
    }
    return nats_read(info, [&](jsConsumerInfo** raw) {
      return js_AddConsumer(raw, js_, settings_.stream.c_str(), &config, nullptr, nullptr);
    });
  }

  /// All messages up to this one are in the rings, since they come in their order; nothing where the rings do
  /// not know the stream.
  [[nodiscard]] std::optional<std::uint64_t> newest_known() const {
    std::optional<std::uint64_t> newest;
    for (Intake* const intake : delivery_.axes().all())
      if (const SourcePosition position = intake->position();
          position.word[0] == created_ && position.word[2] > 0)
        newest = std::max(newest.value_or(0), position.word[2] - 1);  // that one may be there in part
    return newest;
  }

  /// Why this is not the stream or the consumer any more; empty if it is.
  [[nodiscard]] std::string changed() {
    StreamInfo stream;
    if (std::string why = read_stream(stream); !why.empty()) return why;
    if (static_cast<std::uint64_t>(stream->Created) != created_) return "the stream was made anew";
    ConsumerInfo consumer;
    return read_consumer(consumer, false);
  }

  JetStreamSourceSettings settings_;
  jsCtx* js_ = nullptr;
  std::uint64_t created_ = 0;  ///< When the stream was, UNIX time in ns.
  std::uint64_t last_ = 0;     ///< All messages up to this one are in the rings.
  std::uint64_t due_ = 1;      ///< Count of the next delivery.
  bool made_ = false;          ///< The consumer was made just now.
};

}  // namespace

expected<std::unique_ptr<Source>, Error> make_jetstream_source(JetStreamSourceSettings settings, Axes& axes) {
  for (const auto& [field, name] :
       {std::pair("stream", &settings.stream), std::pair("consumer", &settings.consumer)})
    if (!is_stream_name(*name))
      return refuse(field,
                    fmt::format("'{}' is no name; letters without blanks, points, * and > are required",
                                printable(*name)));
  if (!settings.subjects.filter.empty() && !is_subject_filter(settings.subjects.filter))
    return refuse("subjects",
                  fmt::format("'{}' is no filter of subjects; one like machines.*.samples is required",
                              printable(settings.subjects.filter)));
  if (settings.batch < 1 || settings.batch > kMostBatch)
    return refuse("batch", "1 ... 10000 messages are required", settings.batch);
  return std::make_unique<JetStreamSource>(std::move(settings), axes);
}

}  // namespace resonid::monitor
