// SPDX-License-Identifier: MIT
#include <fmt/core.h>

#include "monitor/brokers/nats_handles.hpp"
#include "monitor/brokers/nats_subject.hpp"
#include "monitor/brokers/publisher.hpp"
#include "monitor/samples/faults.hpp"

namespace resonid::monitor {
namespace {

constexpr std::int64_t kConfirm_ms = 5000;
constexpr const char* kMessageId = "Nats-Msg-Id";

class NatsPublisher final : public Publisher {
 public:
  NatsPublisher(NatsSettings settings, bool stored) : settings_(std::move(settings)), stored_(stored) {}

  [[nodiscard]] expected<void, Error> publish(std::string_view key, std::string_view topic,
                                              std::string_view body) override {
    const auto text = with_key(body, key);
    if (!text) return unexpected(text.error());
    if (!is_subject_filter(topic) || topic.find_first_of("*>") != std::string_view::npos)
      return refuse("topic",
                    fmt::format("'{}' is no subject; one without wildcards is required", printable(topic)));
    if (!connection_ || connection_->closed()) {
      auto opened = NatsConnection::open(settings_);
      if (!opened)
        return failed(fmt::format("{}: {}", opened.error().where.view(), opened.error().requirement.view()));
      connection_ = std::move(*opened);
    }
    if (!connection_->connected()) return failed("no server answers");
    NatsMessage message;
    const std::string subject(topic), id(key);
    natsStatus status = nats_read(message, [&](natsMsg** raw) {
      return natsMsg_Create(raw, subject.c_str(), nullptr, text->data(), static_cast<int>(text->size()));
    });
    if (status == NATS_OK) status = natsMsgHeader_Set(message.get(), kMessageId, id.c_str());
    if (status == NATS_OK) status = stored_ ? store(message.get()) : send(message.get());
    if (status != NATS_OK) return failed(fmt::format("'{}': {}", subject, nats_text(status)));
    return {};
  }

 private:
  static unexpected<Error> failed(std::string why) {
    return unexpected<Error>(Error{"publisher", std::move(why)});
  }

  [[nodiscard]] natsStatus store(natsMsg* message) const {
    JetStreamHandle js;
    jsOptions options;
    jsOptions_Init(&options);
    options.Wait = kConfirm_ms;
    const natsStatus status = nats_read(
        js, [&](jsCtx** raw) { return natsConnection_JetStream(raw, connection_->get(), &options); });
    return status == NATS_OK ? js_PublishMsg(nullptr, js.get(), message, nullptr, nullptr) : status;
  }

  /// The server answers a ping after it has taken, or refused, what came before.
  [[nodiscard]] natsStatus send(natsMsg* message) {
    natsStatus status = natsConnection_PublishMsg(connection_->get(), message);
    if (status == NATS_OK) status = natsConnection_FlushTimeout(connection_->get(), kConfirm_ms);
    const char* details = nullptr;
    if (status == NATS_OK) status = natsConnection_GetLastError(connection_->get(), &details);
    if (status != NATS_OK) connection_.reset();  // it would remember the error
    return status;
  }

  NatsSettings settings_;
  bool stored_;
  std::unique_ptr<NatsConnection> connection_;
};

}  // namespace

std::unique_ptr<Publisher> make_nats_publisher(NatsSettings settings, bool stored) {
  return std::make_unique<NatsPublisher>(std::move(settings), stored);
}

}  // namespace resonid::monitor
