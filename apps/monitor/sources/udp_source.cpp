// SPDX-License-Identifier: MIT
#include "monitor/sources/udp_source.hpp"

#include <fmt/core.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <map>

#include "monitor/sources/address.hpp"

namespace resonid::monitor {
namespace {

constexpr double kBindAgain_s = 0.2;
constexpr std::size_t kMostAtOnce = 256;  // datagrams of one socket before another has its turn

class UdpSource final : public NetworkSource {
 public:
  UdpSource(UdpSettings settings, Address address, Axes& axes)
      : NetworkSource(axes), settings_(std::move(settings)), address_(std::move(address)) {}
  ~UdpSource() override { stop(); }
  [[nodiscard]] std::string_view promise() const noexcept override {
    return "What is on its way, and what overflows the kernel's buffer, is lost; a sender that counts its "
           "samples "
           "shows how many.";
  }

 private:
  void run() override {
    Backoff backoff(kBindAgain_s);
    while (!stopping()) {
      auto bound = bind_sockets(address_, SOCK_DGRAM);
      if (bound) return receive(*bound);
      set_state(SourceState::waiting, bound.error().requirement.str());
      static_cast<void>(wait(backoff.next_s()));
    }
  }

  void receive(const BoundSockets& bound) {
    std::vector<::pollfd> sockets;
    for (const Descriptor& socket : bound.sockets) {
      const int on = 1;
      ::setsockopt(socket.get(), SOL_SOCKET, SO_RCVBUF, &settings_.receive_buffer_bytes, sizeof(int));
      ::setsockopt(socket.get(), SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof(on));
      sockets.push_back({socket.get(), POLLIN, 0});
    }
    Decoder decoder(settings_.format, delivery_.faults());
    port_.store(bound.port, std::memory_order_release);  // first: who sees it run may ask for it
    set_state(SourceState::running);
    while (wait(1.0, sockets))
      for (const ::pollfd& socket : sockets)
        for (std::size_t k = 0; k < kMostAtOnce && socket.revents != 0; ++k)
          if (!receive_one(socket.fd, decoder)) break;
  }

  bool receive_one(int socket, Decoder& decoder) {
    ::iovec part{buffer_.data(), buffer_.size()};
    alignas(::cmsghdr) std::array<char, 128> control;
    ::msghdr header{};
    header.msg_iov = &part;
    header.msg_iovlen = 1;
    header.msg_control = control.data();
    header.msg_controllen = control.size();
    const ::ssize_t bytes = ::recvmsg(socket, &header, 0);
    if (bytes < 0) return errno == EINTR;
    for (::cmsghdr* c = CMSG_FIRSTHDR(&header); c != nullptr; c = CMSG_NXTHDR(&header, c)) {
      if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SO_RXQ_OVFL) continue;
      std::uint32_t lost = 0;  // since the socket was made
      std::memcpy(&lost, CMSG_DATA(c), sizeof(lost));
      delivery_.count_lost(lost - std::exchange(overflown_[socket], lost));
    }
    delivery_.count_bytes(static_cast<std::uint64_t>(bytes));
    decoder.message({buffer_.data(), static_cast<std::size_t>(bytes)}, [this](const Message& message) {
      const auto* arrival = std::get_if<Arrival>(&message);
      if (arrival == nullptr)
        delivery_.faults().note(Fault::format, "a question by UDP; frames are required");
      else if (delivery_.add(*arrival) == Intake::Outcome::full)
        delivery_.drop(*arrival);
    });
    return true;
  }

  const UdpSettings settings_;
  const Address address_;
  std::array<char, 65'536> buffer_;
  std::map<int, std::uint32_t> overflown_;  ///< [socket] Datagrams.
};

}  // namespace

expected<std::unique_ptr<NetworkSource>, Error> make_udp_source(UdpSettings settings, Axes& axes) {
  auto address = parse_address(settings.address);
  if (!address) return unexpected(address.error());
  if (!address->path.empty()) return refuse("address", "must be HOST:PORT");
  if (settings.receive_buffer_bytes < 4096)
    return refuse("receive_buffer_bytes", "must be >= 4096", settings.receive_buffer_bytes);
  return std::make_unique<UdpSource>(std::move(settings), *std::move(address), axes);
}

}  // namespace resonid::monitor
