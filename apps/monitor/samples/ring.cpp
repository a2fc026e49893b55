// SPDX-License-Identifier: MIT
#include "monitor/samples/ring.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <string_view>
#include <system_error>

#include "monitor/samples/crc32c.hpp"

namespace resonid::monitor {
namespace {

constexpr std::string_view kMagic = "RSNRING1";
constexpr std::string_view kUnfinished = "RSNRING0";  // is being made
constexpr std::uint32_t kRingVersion = 1;
constexpr std::uint64_t kPage = 4096, kSlotBytes = 256, kSlotWords = 10;
constexpr std::uint64_t kAnchors = 1024;
constexpr std::uint64_t kUsableAnchors = kAnchors - Ring::kMostAnchors;  // the others may be half written
constexpr std::uint64_t kSlotsAt = kPage, kAnchorsAt = 2 * kPage, kDataAt = kAnchorsAt + kAnchors * 32;
constexpr std::int64_t kNoAnchorTime = std::numeric_limits<std::int64_t>::min();
constexpr std::size_t kRingChannels = 16, kChannelBytes = 32, kAxisBytes = 64;

/// The first page of the file.
struct RingHeader {
  std::array<char, 8> magic;
  std::uint32_t version;
  std::uint32_t channels;
  std::uint64_t capacity;
  double sample_rate_hz;
  std::uint32_t anchors;
  std::uint32_t checksum;  ///< Of all else, magic included, with this as 0.
  std::array<char, kAxisBytes> axis;
  std::array<std::array<char, kChannelBytes>, kRingChannels> names;
};
static_assert(sizeof(RingHeader) == 616);

std::uint32_t checksum_of(RingHeader header) noexcept {
  header.checksum = 0;
  return crc32c({reinterpret_cast<const char*>(&header), sizeof header});
}

template <std::size_t N>
std::string field_text(const std::array<char, N>& field) {
  return {field.data(), ::strnlen(field.data(), N)};
}

RingHeader header_of(const RingSettings& settings) {
  RingHeader header{};
  std::copy(kMagic.begin(), kMagic.end(), header.magic.begin());
  header.version = kRingVersion;
  header.channels = static_cast<std::uint32_t>(settings.channels.size());
  header.capacity = settings.capacity;
  header.sample_rate_hz = settings.sample_rate_hz;
  header.anchors = kAnchors;
  std::copy(settings.axis.begin(), settings.axis.end(), header.axis.begin());
  for (std::size_t c = 0; c < settings.channels.size(); ++c)
    std::copy(settings.channels[c].begin(), settings.channels[c].end(), header.names[c].begin());
  header.checksum = checksum_of(header);
  return header;
}

RingSettings settings_of(const RingHeader& header) {
  RingSettings settings{field_text(header.axis), {}, header.sample_rate_hz, header.capacity};
  for (std::size_t c = 0; c < std::min<std::size_t>(header.channels, kRingChannels); ++c)
    settings.channels.push_back(field_text(header.names[c]));
  return settings;
}

/// Those of a file that is a ring.
std::optional<RingSettings> settings_in(const std::filesystem::path& path) {
  RingHeader header{};
  std::ifstream file(path, std::ios::binary);
  if (!file.read(reinterpret_cast<char*>(&header), sizeof header)) return std::nullopt;
  if (std::string_view(header.magic.data(), header.magic.size()) != kMagic) return std::nullopt;
  if (header.checksum != checksum_of(header)) return std::nullopt;
  return settings_of(header);
}

std::string in_words(const RingSettings& settings) {
  std::string names;
  for (const auto& name : settings.channels) names += (names.empty() ? "" : ", ") + name;
  return fmt::format("axis '{}', {} at {} Hz, {} samples", settings.axis, names, settings.sample_rate_hz,
                     settings.capacity);
}

std::uint64_t size_of(const RingSettings& settings) noexcept {
  const std::uint64_t data = settings.capacity * settings.channels.size() * sizeof(double);
  return kDataAt + (data + kPage - 1) / kPage * kPage;
}

expected<void, Error> check_ring(const RingSettings& settings) {
  const auto fits = [](std::string_view name, std::size_t most) {
    return !name.empty() && name.size() <= most && name.find('\0') == std::string_view::npos;
  };
  if (!fits(settings.axis, kAxisBytes)) return refuse("axis", "must be a name of 1 ... 64 bytes");
  if (settings.channels.empty() || settings.channels.size() > kRingChannels)
    return refuse("channels", "must be 1 ... 16", static_cast<double>(settings.channels.size()));
  for (const auto& name : settings.channels)
    if (!fits(name, kChannelBytes)) return refuse("channels", "must have names of 1 ... 32 bytes");
  if (!(settings.sample_rate_hz > 0.0) || !std::isfinite(settings.sample_rate_hz))
    return refuse("sample_rate_hz", "must be > 0", settings.sample_rate_hz);
  if (settings.capacity < 64 || settings.capacity > std::uint64_t{1} << 36U)
    return refuse("capacity", "must be 64 ... 2^36 samples", static_cast<double>(settings.capacity));
  return {};
}

/// What is stored must neither be torn nor be moved before what was stored earlier: other threads copy it,
/// and the process may end at any instruction.
template <class T>
void store(T& place, T value) noexcept {
  std::atomic_ref(place).store(value, std::memory_order_release);
}
template <class T>
T load(T& place) noexcept {
  return std::atomic_ref(place).load(std::memory_order_acquire);
}

using SlotWords = std::array<std::uint64_t, kSlotWords>;

/// Never 0, which is what an empty slot has.
std::uint64_t slot_checksum(const SlotWords& words) noexcept {
  const auto* bytes = reinterpret_cast<const char*>(words.data() + 1);
  return (std::uint64_t{1} << 32U) | crc32c({bytes, (kSlotWords - 1) * sizeof(std::uint64_t)});
}

}  // namespace

unexpected<Error> Ring::failed(std::string what) const {
  return unexpected<Error>(Error{{}, std::move(what), std::nan(""), path_.string()});
}

expected<std::unique_ptr<Ring>, Error> Ring::open(const std::filesystem::path& path,
                                                  const RingSettings& settings) {
  std::string damage;
  return open(path, settings, damage);
}

expected<std::unique_ptr<Ring>, Error> Ring::open(const std::filesystem::path& path,
                                                  const RingSettings& settings, std::string& damage) {
  if (auto checked = check_ring(settings); !checked) return unexpected<Error>(checked.error());
  const auto message = [] { return std::generic_category().message(errno); };
  std::unique_ptr<Ring> ring(new Ring);
  ring->path_ = path;
  ring->settings_ = settings;
  ring->descriptor_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (ring->descriptor_ < 0)
    return ring->failed(fmt::format("cannot open the ring of samples: {}", message()));
  struct ::stat status {};
  if (::fstat(ring->descriptor_, &status) != 0 || !S_ISREG(status.st_mode))
    return ring->failed("this is no file; a ring of samples is required");
  if (::flock(ring->descriptor_, LOCK_EX | LOCK_NB) != 0)
    return ring->failed(errno == EWOULDBLOCK ? "another process uses this ring of samples; one at a time can"
                                             : fmt::format("cannot lock the ring of samples: {}", message()));
  RingHeader header{};
  const ::ssize_t got = ::pread(ring->descriptor_, &header, sizeof header, 0);
  const std::string_view magic(header.magic.data(), header.magic.size());
  const std::uint64_t bytes = size_of(settings);
  if (got == 0 || magic == kUnfinished) {
    if (auto made = ring->make(bytes); !made) return unexpected<Error>(made.error());
    return ring;
  }
  const auto damaged = [&](std::string what) {
    damage = what;
    return ring->failed(std::move(what) + "; remove or rename the file");
  };
  if (header.magic == std::array<char, 8>{}) return damaged("this ring of samples begins with zeros");
  if (magic != kMagic)
    return ring->failed("this is no ring of samples, and is left as it is; another file name is required");
  if (got < static_cast<::ssize_t>(sizeof header) || header.checksum != checksum_of(header))
    return damaged("the header of this ring of samples is damaged");
  if (header.version != kRingVersion || header.anchors != kAnchors)
    return ring->failed(
        fmt::format("a ring of samples of version {}; {} is required", header.version, kRingVersion));
  if (const RingSettings there = settings_of(header); there != settings)
    return ring->failed(
        fmt::format("this ring of samples is of {}; {} is required: remove or rename the file",
                    in_words(there), in_words(settings)));
  if (static_cast<std::uint64_t>(status.st_size) != bytes)
    return damaged(
        fmt::format("this ring of samples has {} bytes, {} are required: it was cut", status.st_size, bytes));
  if (auto mapped = ring->map(bytes); !mapped) return unexpected<Error>(mapped.error());
  if (auto what = ring->restore(); !what.empty()) return damaged(std::move(what));
  return ring;
}

expected<std::unique_ptr<Ring>, Error> Ring::open_or_renew(const std::filesystem::path& path,
                                                           const RingSettings& settings, bool& renewed) {
  const auto there = settings_in(path);
  std::string damage;
  renewed = false;
  auto old = open(path, there.value_or(settings), damage);
  if (!old && !damage.empty()) return replace_damaged(path, settings, damage);
  renewed = old && there && *there != settings;
  if (!renewed) return old;
  auto fresh = path;
  fresh += ".new";
  std::error_code code;
  std::filesystem::remove(fresh, code);
  auto made = open(fresh, settings);
  if (!made) return made;
  (*made)->put_anchor((*old)->next_sample(), std::nullopt);
  (*made)->commit((*old)->source(), (*old)->sender_offset());
  if (auto synced = (*made)->sync(); !synced) return unexpected<Error>(synced.error());
  std::filesystem::rename(fresh, path, code);
  if (code)
    return (*made)->failed(fmt::format("cannot take the place of '{}': {}", path.string(), code.message()));
  (*made)->path_ = path;
  return made;
}

expected<std::unique_ptr<Ring>, Error> Ring::replace_damaged(const std::filesystem::path& path,
                                                             const RingSettings& settings,
                                                             const std::string& damage) {
  std::filesystem::path aside;
  std::error_code code;
  for (int number = 1; aside.empty() || std::filesystem::exists(aside, code); ++number) {
    aside = path;
    aside += fmt::format(".damaged-{}", number);
  }
  std::filesystem::rename(path, aside, code);
  if (code)
    return unexpected<Error>(Error{{},
                                   fmt::format("{}, and it cannot be renamed: {}", damage, code.message()),
                                   std::nan(""),
                                   path.string()});
  auto made = open(path, settings);
  if (made) (*made)->set_aside_ = fmt::format("{}; it is now '{}'", damage, aside.string());
  return made;
}

/// A new file. Its magic is written first as that of an unfinished one and last as that of a ring, when all
/// else is safe from a power cut.
expected<void, Error> Ring::make(std::uint64_t bytes) {
  if (::pwrite(descriptor_, kUnfinished.data(), kUnfinished.size(), 0) !=
      static_cast<::ssize_t>(kUnfinished.size()))
    return failed(
        fmt::format("cannot write the ring of samples: {}", std::generic_category().message(errno)));
  if (auto mapped = map(bytes); !mapped) {
    static_cast<void>(::ftruncate(descriptor_, 0));  // gives back what it could take of the disk
    return mapped;
  }
  const RingHeader header = header_of(settings_);
  std::memset(map_ + kSlotsAt, 0, kDataAt - kSlotsAt);
  std::memcpy(map_ + kMagic.size(), reinterpret_cast<const std::byte*>(&header) + kMagic.size(),
              sizeof header - kMagic.size());
  write_slot();
  if (auto synced = sync(); !synced) return synced;
  store(*reinterpret_cast<std::uint64_t*>(map_), std::bit_cast<std::uint64_t>(header.magic));
  return {};
}

expected<void, Error> Ring::map(std::uint64_t bytes) {
  const int code = ::posix_fallocate(descriptor_, 0, static_cast<::off_t>(bytes));
  if (code != 0)
    return failed(fmt::format("cannot take {} bytes of the disk for the ring of samples: {}", bytes,
                              std::generic_category().message(code)));
  if (::ftruncate(descriptor_, static_cast<::off_t>(bytes)) != 0)  // an unfinished one may have been longer
    return failed(fmt::format("cannot set the size: {}", std::generic_category().message(errno)));
  void* const place = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor_, 0);
  if (place == MAP_FAILED)
    return failed(fmt::format("cannot map the ring of samples: {}", std::generic_category().message(errno)));
  map_ = static_cast<std::byte*>(place);
  bytes_ = bytes;
  data_ = reinterpret_cast<double*>(map_ + kDataAt);
  return {};
}

expected<void, Error> Ring::sync() const {
  if (::fsync(descriptor_) == 0) return {};
  return failed(fmt::format("cannot write the ring of samples: {}", std::generic_category().message(errno)));
}

Ring::~Ring() {
  if (map_ != nullptr) ::munmap(map_, bytes_);
  if (descriptor_ >= 0) ::close(descriptor_);
}

/// Takes up the newest commit that is whole; else what is damaged.
std::string Ring::restore() {
  SlotWords newest{};
  for (std::uint64_t slot = 0; slot < 2; ++slot) {
    SlotWords words{};
    std::memcpy(words.data(), map_ + kSlotsAt + slot * kSlotBytes, sizeof words);
    if (words[0] == slot_checksum(words) && words[1] >= newest[1]) newest = words;
  }
  const std::string wrong_anchors = "this ring of samples has wrong anchors";
  if (newest[1] == 0) return "in this ring of samples both commits are damaged";
  sequence_ = newest[1];
  put_end_ = newest[2];
  put_sample_ = newest[3];
  put_anchors_ = newest[4];
  sender_offset_ = newest[5];
  std::copy_n(newest.begin() + 6, 4, source_.word.begin());
  if (put_end_ > 0 && put_anchors_ == 0) return "this ring of samples has no anchors";
  Anchor before;
  for (std::uint64_t k = oldest_anchor(put_anchors_); k < put_anchors_; ++k) {
    const Anchor now = anchor(k);
    if (now.position < before.position || now.sample < before.sample || now.position > put_end_ ||
        now.sample > put_sample_ || now.sample - before.sample < now.position - before.position ||
        !(now.interval_ns > 0.0) || !(now.interval_ns < 1e18))
      return wrong_anchors;
    before = now;
  }
  if (put_sample_ - before.sample < put_end_ - before.position) return wrong_anchors;
  begin_ = begin_at(put_end_, put_anchors_);
  read_ = begin_.load();
  anchors_ = put_anchors_;
  next_sample_ = put_sample_;
  end_ = put_end_;
  return {};
}

Ring::Anchor Ring::anchor(std::uint64_t number) const noexcept {
  auto& place = *reinterpret_cast<Anchor*>(map_ + kAnchorsAt + number % kAnchors * sizeof(Anchor));
  return {load(place.position), load(place.sample), load(place.time_ns), load(place.interval_ns)};
}

void Ring::set_anchor(std::uint64_t number, const Anchor& anchor) const noexcept {
  static_assert(sizeof(Anchor) == 32);
  auto& place = *reinterpret_cast<Anchor*>(map_ + kAnchorsAt + number % kAnchors * sizeof(Anchor));
  store(place.position, anchor.position);
  store(place.sample, anchor.sample);
  store(place.time_ns, anchor.time_ns);
  store(place.interval_ns, anchor.interval_ns);
}

std::uint64_t Ring::oldest_anchor(std::uint64_t count) noexcept {
  return count > kUsableAnchors ? count - kUsableAnchors : 0;
}

/// The first position that a commit after this one does not touch and an anchor belongs to.
std::uint64_t Ring::begin_at(std::uint64_t end, std::uint64_t anchors) const noexcept {
  const std::uint64_t reach = settings_.capacity - most_samples();
  const std::uint64_t begin = end > reach ? end - reach : 0;
  return oldest_anchor(anchors) == 0 ? begin : std::max(begin, anchor(oldest_anchor(anchors)).position);
}

bool Ring::room(std::uint64_t samples, std::uint64_t anchors) const noexcept {
  const std::uint64_t added = put_end_ - end_.load(std::memory_order_relaxed);
  const std::uint64_t added_anchors = put_anchors_ - anchors_.load(std::memory_order_relaxed);
  if (samples > most_samples() - added || anchors > kMostAnchors - added_anchors) return false;
  return begin_at(put_end_ + samples, put_anchors_ + anchors) <= read();
}

void Ring::put(std::span<const double> values) noexcept {
  const std::size_t width = channels();
  std::uint64_t slot = put_end_ % settings_.capacity;
  for (std::size_t i = 0; i < values.size();) {
    const std::size_t count = std::min<std::size_t>(values.size() - i, (settings_.capacity - slot) * width);
    double* const to = data_ + slot * width;
    for (std::size_t k = 0; k < count; ++k) store(to[k], values[i + k]);
    i += count;
    slot = 0;
  }
  put_end_ += values.size() / width;
  put_sample_ += values.size() / width;
}

void Ring::put_missing(std::uint64_t samples) noexcept {
  std::array<double, kRingChannels> sample{};
  sample.fill(std::numeric_limits<double>::quiet_NaN());
  for (std::uint64_t k = 0; k < samples; ++k) put(std::span(sample).first(channels()));
}

void Ring::put_anchor(std::uint64_t sample, std::optional<std::int64_t> time_ns,
                      std::optional<double> interval_ns) noexcept {
  put_sample_ = sample;
  const bool again = put_anchors_ > anchors_.load(std::memory_order_relaxed) &&
                     anchor(put_anchors_ - 1).position == put_end_;
  if (!again) ++put_anchors_;
  set_anchor(put_anchors_ - 1, {put_end_, sample, time_ns.value_or(kNoAnchorTime),
                                interval_ns.value_or(1e9 / settings_.sample_rate_hz)});
}

/// The older of the two slots; its checksum comes last.
void Ring::write_slot() noexcept {
  ++sequence_;
  SlotWords words{0, sequence_, put_end_, put_sample_, put_anchors_, sender_offset_};
  std::copy(source_.word.begin(), source_.word.end(), words.begin() + 6);
  words[0] = slot_checksum(words);
  auto* const place = reinterpret_cast<std::uint64_t*>(map_ + kSlotsAt + sequence_ % 2 * kSlotBytes);
  store(place[0], std::uint64_t{0});
  for (std::size_t k = 1; k < kSlotWords; ++k) store(place[k], words[k]);
  store(place[0], words[0]);
}

void Ring::commit(const SourcePosition& source, std::uint64_t sender_offset) noexcept {
  source_ = source;
  sender_offset_ = sender_offset;
  write_slot();
  begin_.store(begin_at(put_end_, put_anchors_), std::memory_order_release);
  anchors_.store(put_anchors_, std::memory_order_release);
  next_sample_.store(put_sample_, std::memory_order_release);
  end_.store(put_end_, std::memory_order_release);
}

std::optional<std::int64_t> Ring::next_time_ns() const noexcept {
  if (put_anchors_ == 0) return std::nullopt;
  const Anchor newest = anchor(put_anchors_ - 1);
  if (newest.time_ns == kNoAnchorTime) return std::nullopt;
  return newest.time_ns + std::llround(newest.interval_ns * static_cast<double>(put_end_ - newest.position));
}

double Ring::interval_ns() const noexcept {
  return put_anchors_ == 0 ? 1e9 / settings_.sample_rate_hz : anchor(put_anchors_ - 1).interval_ns;
}

/// The newest of the first `count` anchors of which `before` is true; the oldest usable one where none is.
template <class Before>
std::uint64_t Ring::last_anchor(std::uint64_t count, Before before) const noexcept {
  std::uint64_t low = oldest_anchor(count), high = count;
  while (high - low > 1) {
    const std::uint64_t middle = low + (high - low) / 2;
    (before(anchor(middle)) ? low : high) = middle;
  }
  return low;
}

Piece Ring::piece(std::uint64_t position, std::size_t most) const noexcept {
  const std::uint64_t last = end(), anchors = anchors_.load(std::memory_order_acquire);
  Piece piece;
  piece.position = std::max(position, begin());
  if (piece.position >= last || most == 0) return piece;
  const std::uint64_t number =
      last_anchor(anchors, [&](const Anchor& a) { return a.position <= piece.position; });
  const Anchor here = anchor(number);
  const std::uint64_t next = number + 1 < anchors ? std::min(anchor(number + 1).position, last) : last;
  const std::uint64_t slot = piece.position % settings_.capacity, since = piece.position - here.position;
  piece.first_sample = here.sample + since;
  piece.interval_ns = here.interval_ns;
  if (here.time_ns != kNoAnchorTime)
    piece.time_ns = here.time_ns + std::llround(here.interval_ns * static_cast<double>(since));
  piece.samples = std::min<std::uint64_t>(
      {next - piece.position, settings_.capacity - slot, static_cast<std::uint64_t>(most)});
  piece.values = {data_ + slot * channels(), piece.samples * channels()};
  return piece;
}

Piece Ring::copy(std::uint64_t position, std::size_t most, std::vector<double>& into) const {
  Piece piece = this->piece(position, most);
  into.resize(piece.values.size());
  double* const from = data_ + piece.position % settings_.capacity * channels();
  for (std::size_t i = 0; i < into.size(); ++i) into[i] = load(from[i]);
  // begin() was moved on before anything of this was overwritten, its anchor included
  if (piece.position < begin()) piece.samples = 0;
  piece.values = std::span(into).first(piece.samples * channels());
  return piece;
}

std::uint64_t Ring::position_of(std::uint64_t sample) const noexcept {
  const std::uint64_t last = end(), anchors = anchors_.load(std::memory_order_acquire);
  if (anchors == 0) return last;
  const std::uint64_t number = last_anchor(anchors, [&](const Anchor& a) { return a.sample <= sample; });
  const Anchor here = anchor(number);
  const std::uint64_t next = number + 1 < anchors ? std::min(anchor(number + 1).position, last) : last;
  const std::uint64_t position = here.position + (sample > here.sample ? sample - here.sample : 0);
  return std::max(begin(), std::min(position, next));
}

}  // namespace resonid::monitor
