// SPDX-License-Identifier: MIT
#pragma once

#include <fcntl.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "program.hpp"

namespace resonid::test {

/// Asks until it holds, for ten seconds at most.
template <class Condition>
bool comes_true(Condition&& condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

/// The program while it runs in a folder, its output in out.txt and err.txt there; killed at the latest with
/// the test.
class BackgroundProgram {
 public:
  /// `environment`: NAME=VALUE
  BackgroundProgram(const std::filesystem::path& folder, std::vector<std::string> arguments,
                    const std::vector<std::string>& environment = {})
      : folder_(folder) {
    arguments.insert(arguments.begin(), RESONID_PROGRAM);
    std::vector<char*> words;
    for (auto& argument : arguments) words.push_back(argument.data());
    words.push_back(nullptr);
    process_ = ::fork();
    if (process_ != 0) return;
    for (const auto& variable : environment) ::putenv(const_cast<char*>(variable.c_str()));
    const auto to = [&](const char* name, int descriptor) {
      ::dup2(::open((folder / name).c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), descriptor);
    };
    to("out.txt", STDOUT_FILENO);
    to("err.txt", STDERR_FILENO);
    if (::chdir(folder.c_str()) == 0) ::execv(words[0], words.data());
    ::_exit(127);
  }
  ~BackgroundProgram() {
    if (!ended()) ::kill(process_, SIGKILL);
    static_cast<void>(exit_code());
  }
  BackgroundProgram(const BackgroundProgram&) = delete;
  BackgroundProgram& operator=(const BackgroundProgram&) = delete;

  [[nodiscard]] std::string out() const { return text_of(folder_ / "out.txt"); }
  [[nodiscard]] std::string error() const { return text_of(folder_ / "err.txt"); }
  void signal(int number) const { ::kill(process_, number); }
  [[nodiscard]] bool ended() {
    if (!reaped_ && ::waitpid(process_, &status_, WNOHANG) == process_) reaped_ = true;
    return reaped_;
  }
  /// That of a program that ends by itself; 128 + signal of another.
  [[nodiscard]] int exit_code() {
    if (!reaped_) ::waitpid(process_, &status_, 0);
    reaped_ = true;
    return WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_);
  }

 private:
  std::filesystem::path folder_;
  ::pid_t process_ = -1;
  int status_ = 0;
  bool reaped_ = false;
};

/// What a server on this machine answers to GET; empty: nobody is there.
inline std::string get(int port, const std::string& path) {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  ::sockaddr_in name{};
  name.sin_family = AF_INET;
  name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  name.sin_port = htons(static_cast<std::uint16_t>(port));
  std::string answer;
  const std::string request = "GET " + path + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
                              "\r\nConnection: close\r\n\r\n";
  if (::connect(socket, reinterpret_cast<const ::sockaddr*>(&name), sizeof name) == 0 &&
      ::send(socket, request.data(), request.size(), MSG_NOSIGNAL) > 0) {
    char buffer[4096];
    for (::ssize_t n = 0; (n = ::recv(socket, buffer, sizeof buffer, 0)) > 0;)
      answer.append(buffer, static_cast<std::size_t>(n));
  }
  ::close(socket);
  return answer;
}

/// Stands for systemd.
class NotifySocket {
 public:
  explicit NotifySocket(const std::string& path) : socket_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    ::sockaddr_un name{};
    name.sun_family = AF_UNIX;
    path.copy(static_cast<char*>(name.sun_path), sizeof name.sun_path - 1);
    ok_ = ::bind(socket_, reinterpret_cast<const ::sockaddr*>(&name), sizeof name) == 0;
  }
  ~NotifySocket() { ::close(socket_); }
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;
  [[nodiscard]] bool ok() const noexcept { return ok_; }
  /// All that came so far but for the watchdog's, which is counted.
  [[nodiscard]] const std::vector<std::string>& told() {
    char buffer[4096];
    for (::ssize_t n = 0; (n = ::recv(socket_, buffer, sizeof buffer, MSG_DONTWAIT)) > 0;) {
      const std::string text(buffer, static_cast<std::size_t>(n));
      text == "WATCHDOG=1" ? void(++beats_) : told_.push_back(text);
    }
    return told_;
  }
  [[nodiscard]] int beats() {
    static_cast<void>(told());
    return beats_;
  }

 private:
  int socket_;
  bool ok_ = false;
  std::vector<std::string> told_;
  int beats_ = 0;
};

}  // namespace resonid::test
