// SPDX-License-Identifier: MIT
#include "monitor/sources/command_source.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <spawn.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>

#include "monitor/samples/text_values.hpp"
#include "monitor/sources/thread_source.hpp"

namespace resonid::monitor {
namespace {

constexpr double kLongestAgain_s = 30.0;
constexpr double kRanWell_s = 10.0;  // a command that ran so long is run again without a longer wait
constexpr double kTermination_s = 2.0;
constexpr double kExit_s = 0.02;  // between looks whether it has ended

/// A process with pipes from its outputs, in a group of its own.
class Child {
 public:
  /// errno of what failed; 0: it runs.
  [[nodiscard]] int start(const std::vector<std::string>& command) {
    std::array<int, 2> output{}, errors{};
    if (::pipe2(output.data(), O_CLOEXEC) != 0) return errno;
    output_ = Descriptor(output[0]);
    const Descriptor output_end(output[1]);
    if (::pipe2(errors.data(), O_CLOEXEC) != 0) return errno;
    errors_ = Descriptor(errors[0]);
    const Descriptor errors_end(errors[1]);
    std::vector<char*> arguments;
    for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    ::posix_spawn_file_actions_t actions;
    ::posix_spawnattr_t attributes;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawnattr_init(&attributes);
    ::posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    ::posix_spawn_file_actions_adddup2(&actions, output_end.get(), 1);
    ::posix_spawn_file_actions_adddup2(&actions, errors_end.get(), 2);
    ::sigset_t none, all;
    ::sigemptyset(&none);
    ::sigfillset(&all);
    ::posix_spawnattr_setsigmask(&attributes, &none);  // this thread may block what the child must obey
    ::posix_spawnattr_setsigdefault(&attributes, &all);
    ::posix_spawnattr_setpgroup(&attributes, 0);
    ::posix_spawnattr_setflags(&attributes,
                               POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
    const int code =
        ::posix_spawnp(&process_, arguments[0], &actions, &attributes, arguments.data(), environ);
    ::posix_spawn_file_actions_destroy(&actions);
    ::posix_spawnattr_destroy(&attributes);
    if (code != 0) process_ = -1;
    return code;
  }
  ~Child() {
    if (process_ <= 0) return;
    ::kill(-process_, SIGKILL);  // of its group, which bears its number until it is waited for
    ::waitpid(process_, nullptr, 0);
  }
  Child() = default;
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  [[nodiscard]] int output() const noexcept { return output_.get(); }
  [[nodiscard]] int errors() const noexcept { return errors_.get(); }
  void close_errors() noexcept { errors_.close(); }
  void terminate() const noexcept { ::kill(-process_, SIGTERM); }
  [[nodiscard]] bool has_ended() {
    static_cast<void>(::waitid(P_PID, static_cast<::id_t>(process_), &how_, WEXITED | WNOHANG | WNOWAIT));
    return how_.si_pid == process_;
  }
  [[nodiscard]] std::string how_it_ended() const {
    if (how_.si_pid != process_) return "closed its output";
    return fmt::format("{} {}", how_.si_code == CLD_EXITED ? "ended with code" : "was ended by signal",
                       how_.si_status);
  }

 private:
  Descriptor output_, errors_;
  ::pid_t process_ = -1;
  ::siginfo_t how_{};
};

/// The last line that has come, of no more than some hundred bytes.
class LastLine {
 public:
  void add(std::string_view bytes) {
    text_ += bytes;
    while (!text_.empty() && (text_.back() == '\n' || text_.back() == '\r')) text_.pop_back();
    const std::size_t end = text_.rfind('\n');
    if (end != std::string::npos) text_.erase(0, end + 1);
    if (text_.size() > 4096) text_.resize(4096);
    if (bytes.ends_with('\n')) whole_ = std::exchange(text_, {});
  }
  [[nodiscard]] std::string told() const {
    const std::string& line = text_.empty() ? whole_ : text_;
    return line.empty() ? "" : fmt::format(", last it said '{}'", printable(line, 200));
  }

 private:
  std::string text_, whole_;
};

class CommandSource final : public ThreadSource {
 public:
  CommandSource(CommandSettings settings, Axes& axes) : ThreadSource(axes), settings_(std::move(settings)) {}
  ~CommandSource() override { stop(); }
  [[nodiscard]] std::string_view promise() const noexcept override {
    return "What the command has written and nobody has read yet is lost when the process is killed.";
  }

 private:
  void run() override {
    Backoff backoff(settings_.again_s, std::max(settings_.again_s, kLongestAgain_s));
    Decoder decoder(settings_.format, delivery_.faults());
    while (!stopping()) {
      const auto start = std::chrono::steady_clock::now();
      set_state(SourceState::waiting, run_once(decoder));
      if (std::chrono::steady_clock::now() - start > std::chrono::duration<double>(kRanWell_s))
        backoff.reset();
      static_cast<void>(wait(backoff.next_s()));
    }
  }

  /// Until the command ends; tells how.
  std::string run_once(Decoder& decoder) {
    Child child;
    if (const int code = child.start(settings_.command); code != 0)
      return fmt::format("cannot run '{}': {}", settings_.command.front(), system_error_text(code));
    set_state(SourceState::running);
    const bool wraps = settings_.format.sample_wraps;
    const auto take = [&](const Message& message) {
      const auto* arrived = std::get_if<Arrival>(&message);
      if (arrived == nullptr) return;
      Arrival arrival = *arrived;
      if (const Intake* const intake = delivery_.find(arrival.axis); wraps && intake && arrival.first_sample)
        arrival.first_sample = unwrapped(*arrival.first_sample, intake->next_for_sender());
      static_cast<void>(deliver(arrival));
    };
    std::array<char, 65'536> buffer;
    LastLine said;
    std::array<::pollfd, 2> pipes{{{child.output(), POLLIN, 0}, {child.errors(), POLLIN, 0}}};
    while (wait(1.0, pipes)) {
      if (pipes[1].revents != 0) {
        const ::ssize_t bytes = ::read(child.errors(), buffer.data(), buffer.size());
        if (bytes > 0) said.add({buffer.data(), static_cast<std::size_t>(bytes)});
        if (bytes == 0) {
          child.close_errors();
          pipes[1].fd = -1;
        }
      }
      if (pipes[0].revents == 0) continue;
      const ::ssize_t bytes = ::read(child.output(), buffer.data(), buffer.size());
      if (bytes > 0) {
        delivery_.count_bytes(static_cast<std::uint64_t>(bytes));
        decoder.add({buffer.data(), static_cast<std::size_t>(bytes)}, take);
      } else if (bytes == 0 || (errno != EINTR && errno != EAGAIN)) {
        break;
      }
    }
    decoder.break_off();  // it may have been ended within a line
    if (stopping()) child.terminate();
    finish(child, said, buffer);
    return fmt::format("'{}' {}{}", settings_.command.front(), child.how_it_ended(), said.told());
  }

  /// Gives the command time to end by itself; what it does not use is ended with `child`.
  static void finish(Child& child, LastLine& said, std::span<char> buffer) {
    for (double waited_s = 0.0; !child.has_ended() && waited_s < kTermination_s; waited_s += kExit_s)
      static_cast<void>(::poll(nullptr, 0, static_cast<int>(1e3 * kExit_s)));
    ::pollfd errors{child.errors(), POLLIN, 0};
    while (child.errors() >= 0 && ::poll(&errors, 1, 0) == 1) {
      const ::ssize_t bytes = ::read(child.errors(), buffer.data(), buffer.size());
      if (bytes <= 0) return;
      said.add({buffer.data(), static_cast<std::size_t>(bytes)});
    }
  }

  const CommandSettings settings_;
};

}  // namespace

std::uint64_t unwrapped(std::uint64_t number, std::uint64_t due) noexcept {
  constexpr std::uint64_t kLongestGap = std::uint64_t{1} << 26U;  // over the turn: 18 h at 1 kHz
  const std::uint64_t ahead = (number + kIndexTurn - due % kIndexTurn) % kIndexTurn;
  const bool turned = number < due % kIndexTurn;
  const bool forward = ahead < kIndexTurn / 2 && !(turned && ahead > kLongestGap);
  const std::uint64_t behind = kIndexTurn - ahead;
  return forward || ahead == 0 || behind > due ? due + ahead : due - behind;
}

expected<std::unique_ptr<Source>, Error> make_command_source(CommandSettings settings, Axes& axes) {
  if (settings.command.empty() || settings.command.front().empty())
    return refuse("command", "must be a program and its arguments");
  if (!(settings.again_s > 0.0)) return refuse("again_s", "must be > 0", settings.again_s);
  return std::make_unique<CommandSource>(std::move(settings), axes);
}

}  // namespace resonid::monitor
