// SPDX-License-Identifier: MIT
#include "monitor/brokers/jetstream_pull.hpp"

#include <fmt/core.h>

#include <string_view>

namespace resonid::monitor {
namespace {

constexpr std::int64_t kWait_ms = 50;            // in which the server has a message or says that it has none
constexpr auto kLost = std::chrono::seconds(1);  // after which a request that nobody answers is made anew
constexpr std::string_view kNoMessages = "404", kNoMoreInTime = "408", kNobody = "503", kAlive = "100";

std::string new_inbox() {
  natsInbox* inbox = nullptr;
  if (natsInbox_Create(&inbox) != NATS_OK) return {};
  std::string text = inbox;
  natsInbox_Destroy(inbox);
  return text;
}

std::string_view header(natsMsg* message, const char* name) {
  const char* text = nullptr;
  return natsMsgHeader_Get(message, name, &text) == NATS_OK && text != nullptr ? text : std::string_view{};
}

}  // namespace

JetStreamPull::JetStreamPull(natsConnection* connection, const std::string& stream,
                             const std::string& consumer, int batch)
    : connection_(connection),
      subject_(fmt::format("$JS.API.CONSUMER.MSG.NEXT.{}.{}", stream, consumer)),
      payload_(fmt::format(R"({{"batch":{},"expires":{}}})", batch, kWait_ms * 1'000'000)),
      inbox_(new_inbox()),
      batch_(batch),
      status_(nats_read(subscription_, [&](natsSubscription** handle) {
        return natsConnection_SubscribeSync(handle, connection, (inbox_ + ".*").c_str());
      })) {
  if (status_ == NATS_OK)  // all of a batch may wait
    status_ = natsSubscription_SetPendingLimits(subscription_.get(), -1, -1);
}

natsStatus JetStreamPull::request() {
  answer_ = fmt::format("{}.{}", inbox_, ++requests_);
  const natsStatus status =
      natsConnection_PublishRequestString(connection_, subject_.c_str(), answer_.c_str(), payload_.c_str());
  if (status != NATS_OK) return status;
  due_ = batch_;
  asked_ = std::chrono::steady_clock::now();
  return status;
}

std::string JetStreamPull::next(NatsMessage& message) {
  if (due_ == 0)
    if (const natsStatus status = request(); status != NATS_OK) return nats_text(status);
  const natsStatus status = nats_read(message, [&](natsMsg** handle) {
    return natsSubscription_NextMsg(handle, subscription_.get(), kWait_ms);
  });
  if (status == NATS_TIMEOUT) {  // nothing waits here either
    if (std::chrono::steady_clock::now() - asked_ > kLost) due_ = 0;
    return {};
  }
  if (status != NATS_OK) return nats_text(status);
  if (natsMsg_GetReply(message.get()) != nullptr) {  // a message of the stream: it is to be acknowledged
    if (due_ > 0) --due_;                            // or one of a request that was thought to be lost
    return {};
  }
  const NatsMessage told = std::move(message);
  const std::string_view code = header(told.get(), "Status");
  if (code == kAlive || natsMsg_GetSubject(told.get()) != answer_) return {};
  due_ = 0;
  if (code == kNoMessages || code == kNoMoreInTime) return {};
  if (code == kNobody) return nats_text(NATS_NO_RESPONDERS);
  const std::string_view description = header(told.get(), "Description");
  return description.empty() ? fmt::format("status '{}' of the server", code) : std::string(description);
}

void JetStreamPull::acknowledge(const natsMsg* message) const {
  natsConnection_PublishString(connection_, natsMsg_GetReply(message), "+ACK");
}

}  // namespace resonid::monitor
