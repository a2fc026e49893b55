// SPDX-License-Identifier: MIT
#include "monitor/sources/file_source.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <optional>
#include <set>
#include <system_error>
#include <utility>
#include <vector>

#include "monitor/sources/thread_source.hpp"

namespace resonid::monitor {
namespace {

namespace fs = std::filesystem;

constexpr double kOpenAgain_s = 0.05, kOpenAgainAtMost_s = 1.0;
constexpr std::size_t kBlock = 65'536;
constexpr std::uint64_t kNamesWithin = 1'000'000;      // bytes at either end that are searched for names
constexpr std::uint64_t kMostTruncations = 1'000'000;  // a later birth is another file

/// A file as it lies on its disk, whatever its name.
struct FileIdentity {
  std::uint64_t device = 0, inode = 0;
  std::uint64_t birth_ns = 0;  ///< 0: the file system does not tell.
  std::uint64_t size = 0;      ///< Now.

  // A reboot or another mount may give the device another number: the birth, where it is known, tells more.
  [[nodiscard]] bool is(const FileIdentity& other) const noexcept {
    return inode == other.inode && birth_ns == other.birth_ns && (birth_ns > 0 || device == other.device);
  }
  [[nodiscard]] bool is_of(const SourcePosition& position) const noexcept {
    return position.word[1] == inode && position.word[2] >= birth_ns &&
           position.word[2] - birth_ns <= kMostTruncations &&
           (birth_ns > 0 || position.word[0] == device || size >= position.word[3]);
  }
};

/// Of a regular file; `code` tells why there is none.
std::optional<FileIdentity> identity_of(int folder, const char* path, int flags, int& code) {
  struct ::statx status {};
  code = 0;
  if (::statx(folder, path, flags, STATX_BASIC_STATS | STATX_BTIME, &status) != 0) {
    code = errno;
    return std::nullopt;
  }
  if (!S_ISREG(status.stx_mode)) return std::nullopt;
  FileIdentity identity{::makedev(status.stx_dev_major, status.stx_dev_minor), status.stx_ino, 0,
                        status.stx_size};
  if ((status.stx_mask & STATX_BTIME) != 0)
    identity.birth_ns =
        static_cast<std::uint64_t>(status.stx_btime.tv_sec) * 1'000'000'000U + status.stx_btime.tv_nsec;
  return identity;
}

std::optional<FileIdentity> identity_of(const fs::path& path) {
  int code = 0;
  return identity_of(AT_FDCWD, path.c_str(), 0, code);
}

struct NamedFile {
  fs::path path;
  FileIdentity identity;
};

/// The file and what it was renamed to.
std::vector<NamedFile> generations_of(const fs::path& path) {
  std::vector<NamedFile> all;
  if (const auto identity = identity_of(path)) all.push_back({path, *identity});
  const std::string name = path.filename().string();
  std::error_code code;
  const fs::path folder = path.parent_path();
  for (fs::directory_iterator entry(folder.empty() ? "." : folder, code), end; !code && entry != end;
       entry.increment(code)) {
    const std::string other = entry->path().filename().string();
    if (other.size() <= name.size() || !other.starts_with(name) ||
        other.find_first_not_of("0123456789.-_T", name.size()) != std::string::npos)
      continue;
    if (const auto identity = identity_of(entry->path())) all.push_back({entry->path(), *identity});
  }
  return all;
}

class FileSource final : public ThreadSource {
 public:
  FileSource(FileSettings settings, Axes& axes)
      : ThreadSource(axes),
        settings_(std::move(settings)),
        decoder_(settings_.format, delivery_.faults()),
        from_end_(!settings_.from_start) {}
  ~FileSource() override { stop(); }
  [[nodiscard]] std::string_view promise() const noexcept override {
    return "Nothing is lost when the process is killed, as long as the file and those it was renamed to are "
           "there.";
  }

 private:
  void run() override {
    Backoff backoff(kOpenAgain_s, kOpenAgainAtMost_s);
    while (!stopping()) {
      const auto next = file_ ? successor() : resume();
      if (next && open(*next)) {
        backoff.reset();
        set_state(SourceState::running);
        follow();
        continue;
      }
      if (!next) {
        from_end_ = false;  // what comes later is new
        set_state(SourceState::waiting, why_none());
      }
      static_cast<void>(wait(backoff.next_s()));
    }
  }

  std::string why_none() const {
    int code = 0;
    const bool there = identity_of(AT_FDCWD, settings_.path.c_str(), 0, code).has_value();
    const std::string why = code != 0 ? system_error_text(code) : there ? "" : "a regular file is required";
    return fmt::format("for '{}'{}{}", settings_.path.string(), why.empty() ? "" : ": ", why);
  }

  /// The oldest file in which an axis stands; where there is none, the first that is not known.
  std::optional<NamedFile> resume() const {
    std::optional<NamedFile> oldest;
    for (const NamedFile& file : generations_of(settings_.path))
      if (stands_in(file.identity) && (!oldest || file.identity.birth_ns < oldest->identity.birth_ns ||
                                       (file.identity.birth_ns == 0 && file.path != settings_.path)))
        oldest = file;
    return oldest ? oldest : successor();
  }
  bool stands_in(const FileIdentity& file) const {
    const auto all = delivery_.axes().all();
    return std::any_of(all.begin(), all.end(),
                       [&](const Intake* intake) { return file.is_of(intake->position()); });
  }

  /// The file that was made next after this one, or after those in which the axes stood; where that is not
  /// known, the one that has the name now.
  std::optional<NamedFile> successor() const {
    std::optional<NamedFile> best;
    std::uint64_t after_ns = identity_.birth_ns;
    for (const NamedFile& file : generations_of(settings_.path)) {
      const FileIdentity& other = file.identity;
      if (file_ && other.is(identity_)) continue;
      if (file.path == settings_.path) {  // comes first
        best = file;
        if (!file_)
          for (const Intake* intake : delivery_.axes().all())
            after_ns = std::max(after_ns, intake->position().word[2]);
      } else if (best && after_ns > 0 && other.birth_ns > after_ns &&
                 other.birth_ns < best->identity.birth_ns) {
        best = file;
      }
    }
    return best;
  }

  bool open(const NamedFile& file) {
    Descriptor opened(::open(file.path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    int code = errno;
    const auto identity =
        opened ? identity_of(opened.get(), "", AT_EMPTY_PATH, code) : std::optional<FileIdentity>();
    if (!identity) {
      set_state(SourceState::waiting,
                fmt::format("cannot open '{}': {}", file.path.string(), system_error_text(code)));
      return false;
    }
    if (!identity->is(file.identity)) return false;  // renamed meanwhile
    file_ = std::move(opened);
    identity_ = *identity;
    generation_ = identity_.birth_ns;
    offset_ = 0;
    ahead_.clear();
    const std::vector<NamedFile> generations = generations_of(settings_.path);
    std::vector<SourcePosition> stands;
    std::vector<Intake*> elsewhere;
    bool behind = false;  // one that knows nothing of this file
    for (Intake* intake : delivery_.axes().all()) {
      SourcePosition position = intake->position();
      if (identity_.is_of(position)) {
        // By another number of the device, what is read again would be new.
        if (std::exchange(position.word[0], identity_.device) != identity_.device) intake->reached(position);
        stands.push_back(position);
        generation_ = std::max(generation_, position.word[2]);
      } else if (std::any_of(generations.begin(), generations.end(), [&](const NamedFile& other) {
                   return comes_later(other) && other.identity.is_of(position);
                 })) {
        ahead_.insert(intake);
      } else {
        elsewhere.push_back(intake);
        behind = behind || position.told();
      }
    }
    const bool known = behind || !stands.empty() || !ahead_.empty();
    std::uint64_t from = stands.empty() || behind ? 0 : UINT64_MAX;
    if (std::exchange(from_end_, false) && !known) from = identity_.size;
    for (const SourcePosition& position : stands)
      from = std::min(from, position.word[2] == generation_ ? position.word[3] : 0);
    if (from > identity_.size) {
      ++generation_;  // truncated while nobody looked
      from = 0;
    }
    // Before anything is read: a restart after the first samples of one axis must not pass over the others'.
    safe_ = told_ = from;
    for (Intake* intake : elsewhere) intake->reached(position_at(from));
    decoder_.seek(0);
    if (from > 0 || decoder_.wants_names()) learn_names(file, from);
    if (from > 0) go_to(from);
    return true;
  }

  /// Whether a file is read after the one that is open.
  bool comes_later(const NamedFile& other) const {
    return !other.identity.is(identity_) &&
           (other.path == settings_.path ||
            (identity_.birth_ns > 0 && other.identity.birth_ns > identity_.birth_ns));
  }

  SourcePosition position_at(std::uint64_t byte) const {
    return {{identity_.device, identity_.inode, generation_, byte}};
  }

  /// Goes on at the beginning of a line there.
  void go_to(std::uint64_t byte) {
    offset_ = frames() ? byte : begin_of_line(file_, byte);
    decoder_.seek(offset_);
  }

  /// Where the line begins that goes on there; not looked for further than a line can be long.
  std::uint64_t begin_of_line(const Descriptor& file, std::uint64_t byte) {
    std::uint64_t line = byte;
    while (line > 0 && byte - line <= kLongestLine) {
      const std::uint64_t begin = line - std::min<std::uint64_t>(line, kBlock);
      const std::string_view block = read(file, begin).substr(0, line - begin);
      const std::size_t end = block.rfind('\n');
      line = begin + (end == std::string_view::npos ? 0 : end + 1);
      if (end != std::string_view::npos) break;
    }
    return line;
  }

  /// The names of columns that count at a byte of this file, where lines before it tell them; else, while
  /// there are none, those that the file before it ends with.
  void learn_names(const NamedFile& file, std::uint64_t byte) {
    if (settings_.format.kind != SampleFormat::csv || learn_names_in(file_, byte) || !decoder_.wants_names())
      return;
    std::vector<NamedFile> before = generations_of(settings_.path);
    std::erase_if(before, [&](const NamedFile& other) {
      return other.identity.is(file.identity) || other.identity.birth_ns > file.identity.birth_ns;
    });
    std::sort(before.begin(), before.end(), [](const NamedFile& a, const NamedFile& b) {
      return a.identity.birth_ns != b.identity.birth_ns ? a.identity.birth_ns > b.identity.birth_ns
                                                        : a.path < b.path;
    });
    for (const NamedFile& other : before) {
      const Descriptor opened(::open(other.path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
      if (stopping() || (opened && learn_names_in(opened, other.identity.size))) return;
    }
  }

  /// Reads what is before that byte, of a large file its beginning and what comes last.
  bool learn_names_in(const Descriptor& file, std::uint64_t byte) {
    FaultLog unheard;
    Decoder reader(settings_.format, unheard);
    const auto read_lines = [&](std::uint64_t from, std::uint64_t to) {
      while (from < to && !stopping()) {
        const std::string_view bytes = read(file, from).substr(0, to - from);
        if (bytes.empty()) return;
        reader.add(bytes, [](const Message&) {});
        from += bytes.size();
      }
    };
    const std::uint64_t end = begin_of_line(file, byte);
    if (end <= 2 * kNamesWithin) {
      read_lines(0, end);
    } else {
      read_lines(0, begin_of_line(file, kNamesWithin));
      read_lines(begin_of_line(file, end - kNamesWithin), end);
    }
    decoder_.adopt_names(reader, &file == &file_);
    return !reader.wants_names();
  }

  std::string_view read(const Descriptor& file, std::uint64_t from) {
    ::ssize_t bytes = 0;
    do bytes = ::pread(file.get(), buffer_.data(), buffer_.size(), static_cast<::off_t>(from));
    while (bytes < 0 && errno == EINTR);
    read_error_ = bytes < 0 ? errno : 0;
    return {buffer_.data(), static_cast<std::size_t>(std::max<::ssize_t>(bytes, 0))};
  }

  /// Until there is another file in its place, or it cannot be read.
  void follow() {
    bool replaced = false;
    while (!stopping()) {
      const std::string_view bytes = read(file_, offset_);
      if (read_error_ != 0) {
        set_state(SourceState::waiting, fmt::format("cannot read '{}': {}", settings_.path.string(),
                                                    system_error_text(read_error_)));
        file_.close();  // to be opened again where the rings stand
        static_cast<void>(wait(kOpenAgainAtMost_s));
        return;
      }
      if (!bytes.empty()) {
        const std::uint64_t begin = std::exchange(offset_, offset_ + bytes.size());
        delivery_.count_bytes(bytes.size());
        decoder_.add(bytes, [this](const Message& message) { take(message); });
        // Lines that lack names of columns are read again after a restart: it may find them.
        if (const std::size_t line = bytes.rfind('\n');
            line != std::string_view::npos && !frames() && !decoder_.wants_names())
          safe_ = begin + line + 1;
        set_state(SourceState::running);
        continue;
      }
      if (replaced) {  // and read to its end since
        decoder_.finish([this](const Message& message) { take(message); });
        return;
      }
      tell_axes();
      int code = 0;
      const auto now = identity_of(file_.get(), "", AT_EMPTY_PATH, code);
      if (now && now->size < offset_) {
        ++generation_;
        offset_ = safe_ = 0;
        decoder_.seek(0);
        continue;
      }
      // An empty one may have been made for a writer that still writes the old one.
      const auto named = identity_of(settings_.path);
      if (!named) set_state(SourceState::waiting, why_none());  // and what its writer still adds is taken
      replaced = named && !named->is(identity_) && named->size > 0;
      if (!replaced) static_cast<void>(wait(settings_.poll_s));
    }
  }

  /// Lets axes of which nothing comes go on with the others, or a restart would begin where they were left.
  void tell_axes() {
    const auto now = std::chrono::steady_clock::now();
    if (stopping() || safe_ == told_ || now - last_told_ < std::chrono::seconds(1)) return;
    last_told_ = now;
    told_ = safe_;
    for (Intake* intake : delivery_.axes().all())
      if (!ahead_.contains(intake)) intake->reached(position_at(safe_));
  }

  bool frames() const noexcept { return settings_.format.kind == SampleFormat::frame; }

  void take(const Message& message) {
    const auto* arrival = std::get_if<Arrival>(&message);
    if (arrival == nullptr) return;
    if (frames()) safe_ = decoder_.end_of(*arrival);
    if (!ahead_.empty())
      if (Intake* const intake = delivery_.find(arrival->axis); ahead_.contains(intake)) {
        delivery_.count_message();
        return intake->passed_over(arrival->samples());
      }
    static_cast<void>(deliver(*arrival, position_at(decoder_.end_of(*arrival))));
  }

  const FileSettings settings_;
  Decoder decoder_;
  bool from_end_;  ///< The first file that is opened is read from its end on, where nothing is known of it.
  Descriptor file_;
  FileIdentity identity_;
  std::uint64_t generation_ = 0;  ///< Word 2 of the position.
  std::uint64_t offset_ = 0;      ///< Of the next byte to read.
  std::set<Intake*> ahead_;       ///< Axes that stand in a later file.
  std::uint64_t safe_ = 0;        ///< Byte before which everything is taken.
  std::uint64_t told_ = 0;        ///< What the axes know of it.
  std::chrono::steady_clock::time_point last_told_{};
  std::array<char, kBlock> buffer_;
  int read_error_ = 0;
};

}  // namespace

expected<std::unique_ptr<Source>, Error> make_file_source(FileSettings settings, Axes& axes) {
  if (settings.path.empty()) return refuse("path", "must be the name of a file");
  if (!(settings.poll_s > 0.0)) return refuse("poll_s", "must be > 0", settings.poll_s);
  return std::make_unique<FileSource>(std::move(settings), axes);
}

}  // namespace resonid::monitor
