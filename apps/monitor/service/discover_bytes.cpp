// SPDX-License-Identifier: MIT
#include "monitor/service/discover_bytes.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <list>
#include <system_error>

#include "io/text.hpp"
#include "monitor/sources/address.hpp"

namespace resonid::monitor {
namespace {

using Bytes = std::array<char, 65'536>;

/// A search that ends by itself.
class Search {
 public:
  Search(double seconds, const KeepLooking& keep) : keep_(keep), end_s_(now_s() + seconds) {}

  static double now_s() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  }
  [[nodiscard]] bool goes_on() const { return now_s() < end_s_ && keep_(); }
  /// Until one of them is ready, for a short time.
  static void wait(std::vector<::pollfd>& descriptors) {
    constexpr int kTick_ms = 50;
    static_cast<void>(::poll(descriptors.data(), descriptors.size(), kTick_ms));
  }

 private:
  const KeepLooking& keep_;
  double end_s_;
};

std::string_view read_part(Bytes& buffer, ::ssize_t bytes) {
  return {buffer.data(), static_cast<std::size_t>(bytes)};
}

unexpected<Error> not_read(const std::string& what, int code) {
  return unexpected<Error>(
      Error{"", fmt::format("{} cannot be read: {}", what, std::generic_category().message(code))});
}

/// Once nothing more comes, times of arrival tell nothing.
std::vector<Discovered> without_arrival(std::vector<Discovered> all) {
  for (auto& one : all) one.measured_rate_hz = 0.0;
  return all;
}

struct DiscoveredClient {
  DiscoveredClient(Descriptor descriptor, Scout& scout)
      : socket(std::move(descriptor)), bytes(scout, [this](std::string_view axis) {
          constexpr std::size_t kMostAnswers = 65'536;
          if (answers.size() < kMostAnswers) answers += encoded(Acknowledgement{axis, 0});
        }) {}
  Descriptor socket;
  std::string answers;
  ByteScout bytes;
};

/// False when the client is gone.
bool serve(DiscoveredClient& client, short events, Bytes& buffer) {
  if ((events & (POLLIN | POLLHUP | POLLERR)) != 0) {
    const ::ssize_t bytes = ::recv(client.socket.get(), buffer.data(), buffer.size(), 0);
    if (bytes == 0 || (bytes < 0 && errno != EINTR && errno != EAGAIN)) return false;
    if (bytes > 0) client.bytes.add(read_part(buffer, bytes), Search::now_s());
  }
  if (client.answers.empty()) return true;
  const ::ssize_t sent =
      ::send(client.socket.get(), client.answers.data(), client.answers.size(), MSG_NOSIGNAL);
  if (sent > 0) client.answers.erase(0, static_cast<std::size_t>(sent));
  return sent >= 0 || errno == EINTR || errno == EAGAIN;
}

expected<BoundSockets, Error> listening_at(const std::string& text, int type) {
  const auto address = parse_address(text);
  if (!address) return unexpected(address.error());
  return bind_sockets(*address, type);
}

std::vector<::pollfd> polled(const BoundSockets& bound) {
  std::vector<::pollfd> descriptors;
  for (const Descriptor& socket : bound.sockets) descriptors.push_back({socket.get(), POLLIN, 0});
  return descriptors;
}

}  // namespace

expected<std::vector<Discovered>, Error> discover_file(const std::filesystem::path& path, double seconds,
                                                       const KeepLooking& keep) {
  const std::string name = io::in_quotes(path.string());
  std::error_code code;
  if (!std::filesystem::is_regular_file(path, code))
    return unexpected<Error>(Error{
        "",
        fmt::format("found {}, required a file: {}", name,
                    std::filesystem::exists(path, code) ? "that is none" : "there is none of that name")});
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!file) return not_read(name, errno);
  auto found = discover_pipe(file.get(), seconds, keep);
  if (!found) return found;
  if (found->empty())
    return refuse("", fmt::format("{} holds no samples; required CSV, JSON, line protocol or frames", name));
  return without_arrival(std::move(*found));
}

expected<std::vector<Discovered>, Error> discover_pipe(int descriptor, double seconds,
                                                       const KeepLooking& keep) {
  const Search search(seconds, keep);
  Scout scout;
  ByteScout bytes(scout);
  Bytes buffer;
  std::vector<::pollfd> descriptors{{descriptor, POLLIN, 0}};
  bool ended = false;
  while (!ended && search.goes_on()) {
    Search::wait(descriptors);
    if (descriptors.front().revents == 0) continue;
    const ::ssize_t count = ::read(descriptor, buffer.data(), buffer.size());
    if (count < 0 && errno != EINTR && errno != EAGAIN) return not_read("standard input", errno);
    if (count > 0) bytes.add(read_part(buffer, count), Search::now_s());
    ended = count == 0;
  }
  bytes.finish(Search::now_s());
  return ended ? without_arrival(scout.found()) : scout.found();
}

expected<std::vector<Discovered>, Error> discover_tcp(const std::string& address, double seconds,
                                                      const KeepLooking& keep) {
  constexpr std::size_t kMostClients = 1000;
  const auto bound = listening_at(address, SOCK_STREAM);
  if (!bound) return unexpected(bound.error());
  const Search search(seconds, keep);
  Scout scout;
  Bytes buffer;
  std::list<DiscoveredClient> clients;
  while (search.goes_on()) {
    auto descriptors = polled(*bound);
    for (const auto& client : clients)
      descriptors.push_back(
          {client.socket.get(), static_cast<short>(POLLIN | (client.answers.empty() ? 0 : POLLOUT)), 0});
    Search::wait(descriptors);
    auto polled_client = descriptors.begin() + static_cast<std::ptrdiff_t>(bound->sockets.size());
    for (auto client = clients.begin(); client != clients.end(); ++polled_client) {
      const bool there = serve(*client, polled_client->revents, buffer);
      if (!there) client->bytes.finish(Search::now_s());
      client = there ? std::next(client) : clients.erase(client);
    }
    for (std::size_t i = 0; i < bound->sockets.size(); ++i) {
      if (descriptors[i].revents == 0) continue;
      Descriptor socket(::accept4(descriptors[i].fd, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
      if (socket && clients.size() < kMostClients) clients.emplace_back(std::move(socket), scout);
    }
  }
  for (auto& client : clients) client.bytes.finish(Search::now_s());
  return scout.found();
}

expected<std::vector<Discovered>, Error> discover_udp(const std::string& address, double seconds,
                                                      const KeepLooking& keep) {
  const auto bound = listening_at(address, SOCK_DGRAM);
  if (!bound) return unexpected(bound.error());
  const Search search(seconds, keep);
  Scout scout;
  Bytes buffer;
  auto descriptors = polled(*bound);
  while (search.goes_on()) {
    Search::wait(descriptors);
    for (const auto& socket : descriptors) {
      if (socket.revents == 0) continue;
      const ::ssize_t bytes = ::recv(socket.fd, buffer.data(), buffer.size(), 0);
      if (bytes > 0) scout.add({}, {}, read_part(buffer, bytes), Search::now_s());
    }
  }
  return scout.found();
}

}  // namespace resonid::monitor
