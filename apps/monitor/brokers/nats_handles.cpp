// SPDX-License-Identifier: MIT
#include "monitor/brokers/nats_handles.hpp"

#include <fmt/core.h>

#include <cmath>
#include <fstream>
#include <iterator>

namespace resonid::monitor {
namespace {

constexpr int kTimeout_ms = 2000, kReconnect_ms = 250, kPing_ms = 10'000;

natsStatus set_tls(natsOptions* options, const Tls& tls) {
  natsStatus status = natsOptions_SetSecure(options, true);
  if (status == NATS_OK && !tls.authorities.empty())
    status = natsOptions_LoadCATrustedCertificates(options, tls.authorities.c_str());
  if (status == NATS_OK && !tls.certificate.empty())
    status = natsOptions_LoadCertificatesChain(options, tls.certificate.c_str(), tls.key.c_str());
  return status;
}

natsStatus set_token(natsOptions* options, const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (text.find("-----BEGIN") != std::string::npos)
    return natsOptions_SetUserCredentialsFromFiles(options, path.c_str(), nullptr);
  const std::size_t first = text.find_first_not_of(" \t");
  if (first == std::string::npos) return NATS_INVALID_ARG;
  return natsOptions_SetToken(options,
                              text.substr(first, text.find_first_of(" \t\r\n", first) - first).c_str());
}

natsStatus set_access(natsOptions* options, const NatsSettings& settings) {
  natsStatus status = NATS_OK;
  if (const auto& credentials = settings.access.credentials)
    status = natsOptions_SetUserInfo(options, credentials->user.c_str(), credentials->password.c_str());
  if (status == NATS_OK && !settings.token_file.empty()) status = set_token(options, settings.token_file);
  if (status == NATS_OK && settings.access.tls) status = set_tls(options, *settings.access.tls);
  return status;
}

}  // namespace

std::string nats_text(natsStatus status) {
  natsStatus last = NATS_OK;
  const char* newest = nats_GetLastError(&last);
  const std::string_view text = natsStatus_GetText(status);
  std::string_view details = newest != nullptr && last == status ? newest : "";
  if (const auto place = details.find("): ");  // "(conn.c:733): " says nothing to users
      details.starts_with('(') && place != details.npos)
    details.remove_prefix(place + 3);
  if (details.empty() || details == text) return std::string(text);
  return fmt::format("{}: {}", text, details);
}

expected<std::unique_ptr<NatsConnection>, Error> NatsConnection::open(const NatsSettings& settings) {
  const auto failed = [&](natsStatus status) {
    return unexpected<Error>(Error{"nats", nats_text(status), std::nan(""),
                                   settings.servers.empty() ? "no server" : settings.servers.front()});
  };
  std::vector<const char*> servers;
  for (const auto& server : settings.servers) servers.push_back(server.c_str());
  std::unique_ptr<NatsConnection> connection(new NatsConnection);
  NatsOptions options;
  natsStatus status = nats_read(options, natsOptions_Create);
  const auto set = [&](natsStatus next) {
    if (status == NATS_OK) status = next;
  };
  natsOptions* const o = options.get();
  set(natsOptions_SetServers(o, servers.data(), static_cast<int>(servers.size())));
  set(natsOptions_SetTimeout(o, kTimeout_ms));
  set(natsOptions_SetMaxReconnect(o, -1));
  set(natsOptions_SetReconnectWait(o, kReconnect_ms));
  set(natsOptions_SetPingInterval(o, kPing_ms));
  set(natsOptions_SetReconnectedCB(
      o,
      [](natsConnection*, void* self) {
        static_cast<NatsConnection*>(self)->reconnects_.fetch_add(1, std::memory_order_acq_rel);
      },
      connection.get()));
  set(natsOptions_SetClosedCB(
      o,
      [](natsConnection*, void* self) {
        auto& owner = *static_cast<NatsConnection*>(self);
        const std::lock_guard lock(owner.mutex_);
        owner.ended_ = true;
        owner.ended_changed_.notify_all();
      },
      connection.get()));
  set(natsOptions_SetErrorHandler(
      o,
      [](natsConnection* handle, natsSubscription*, natsStatus error, void* self) {
        auto& owner = *static_cast<NatsConnection*>(self);
        const char* details = nullptr;
        natsConnection_GetLastError(handle, &details);
        const std::lock_guard lock(owner.mutex_);
        owner.error_ = details != nullptr && *details != '\0'
                           ? fmt::format("{}: {}", natsStatus_GetText(error), details)
                           : natsStatus_GetText(error);
      },
      connection.get()));
  if (status == NATS_OK) status = set_access(o, settings);
  if (status != NATS_OK) return failed(status);
  status = nats_read(connection->handle_,
                     [&](natsConnection** handle) { return natsConnection_Connect(handle, o); });
  if (status != NATS_OK) return failed(status);
  return connection;
}

/// After the callback that tells of the end none comes.
NatsConnection::~NatsConnection() {
  if (!handle_) return;
  natsConnection_Close(handle_.get());
  std::unique_lock lock(mutex_);
  ended_changed_.wait(lock, [this] { return ended_; });
}

std::string NatsConnection::take_error() {
  const std::lock_guard lock(mutex_);
  return std::exchange(error_, {});
}

}  // namespace resonid::monitor
