// SPDX-License-Identifier: MIT
#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/err.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <optional>
#include <resonid/base/error_text.hpp>
#include <resonid/io/detail/suggestion.hpp>
#include <resonid/io/experiment.hpp>
#include <resonid/io/shipped_experiments.hpp>
#include <set>
#include <system_error>

#include "io/text.hpp"
#include "monitor/samples/text_decoder.hpp"
#include "monitor/service/axis_spec_of.hpp"
#include "monitor/service/configuration.hpp"
#include "monitor/web/channel.hpp"
#include "monitor/web/server.hpp"

namespace resonid::monitor {
namespace {

namespace fs = std::filesystem;

bool is_name_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '.' ||
         c == '-';
}

bool is_name(std::string_view name) {
  constexpr std::size_t kLongest = 64;
  return !name.empty() && name.size() <= kLongest && std::all_of(name.begin(), name.end(), is_name_character);
}

/// By trying, and nothing is left behind: a privileged user has every permission in /proc, which keeps no
/// files. A full disk is no fault of the folder.
bool takes_files(const fs::path& folder) {
  constexpr ::mode_t kOwn = 0600;
  const int file = ::open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, kOwn);
  if (file >= 0) return ::close(file) == 0;
  if (errno == EOPNOTSUPP || errno == EISDIR) {
    std::string name = (folder / ".resonid-XXXXXX").string();
    if (::mkdtemp(name.data()) != nullptr) return ::rmdir(name.c_str()) == 0;
  }
  return errno == ENOSPC || errno == EDQUOT;
}

/// Folder of its own: another process cannot be kept from changing it afterwards.
bool can_be_made_or_written(const fs::path& folder) {
  std::error_code code;
  fs::path there = fs::absolute(folder, code);
  while (!fs::exists(there, code) && there.has_relative_path()) there = there.parent_path();
  return fs::is_directory(there, code) && ::access(there.c_str(), W_OK | X_OK) == 0 && takes_files(there);
}

/// Names of columns that lines at the beginning of a CSV file tell, and of a large one those that come last;
/// empty: none does.
std::vector<std::string> columns_in(const fs::path& path) {
  constexpr std::size_t kWithin = 1'000'000;  // bytes at either end
  std::error_code code;
  if (!fs::is_regular_file(path, code)) return {};
  FaultLog unheard;
  TextDecoder decoder({}, unheard);
  std::vector<std::string> names;
  const auto add = [&](const auto& more) {
    for (const auto& name : more)
      if (std::find(names.begin(), names.end(), name) == names.end()) names.emplace_back(name);
  };
  std::ifstream stream(path, std::ios::binary);
  const auto decode = [&] {
    std::string text(kWithin, '\0');
    stream.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(stream.gcount()));
    decoder.add(text, [&](const Arrival& arrival) { add(arrival.columns); });
    add(decoder.names());
  };
  decode();
  const auto bytes = fs::file_size(path, code);
  if (code || bytes <= 2 * kWithin) return names;
  decoder.seek(bytes - kWithin);
  stream.seekg(static_cast<std::streamoff>(bytes - kWithin));
  std::string half;
  std::getline(stream, half);
  decode();
  return names;
}

/// What two of which cannot be, with who has it.
class Claims {
 public:
  /// Who had it before; empty: nobody.
  std::string claim(const std::string& thing, const std::string& who) {
    const auto [place, is_new] = claimed_.emplace(thing, who);
    return is_new ? std::string() : place->second;
  }

 private:
  std::map<std::string, std::string> claimed_;
};

/// One fault of each of its tables.
struct AlarmFaults {
  std::vector<TableFault>& all;
  template <class Field>
  void operator()(std::string_view name, Field& field, std::string_view) const {
    if (const auto fine = monitoring::check(field); !fine) {
      Error fault = fine.error();
      fault.field = fmt::format("{}.{}", name, fault.field.view());
      all.push_back({std::move(fault), false});
    }
  }
};

std::vector<TableFault> alarm_faults(monitoring::AxisAlarmSettings alarms) {
  std::vector<TableFault> all;
  describe(AlarmFaults{all}, alarms);
  return all;
}

class Checker {
 public:
  Checker(const Configuration& configuration, const Origin& origin) : c_(configuration), origin_(origin) {}

  Findings all() {
    table("monitor", faults(c_.monitor));
    table("retention", faults(c_.retention));
    table("publish", faults(c_.publish));
    table("publish.mqtt", faults(c_.publish.mqtt));
    table("publish.nats", faults(c_.publish.nats));
    const bool sound_alarms = table("alarms", alarm_faults(c_.alarms));
    service();
    published();
    for (const auto& [name, source] : c_.sources.tables) one_source(name, source);
    if (c_.axes.tables.empty() && is_read("axis"))
      error("axis", "must have a table for each axis, [axis.NAME]: found none");
    for (const auto& [name, axis] : c_.axes.tables) one_axis(name, axis);
    if (sound_alarms && is_read("alarms") && is_read("axis")) alarms_of_all();
    if (is_read("axis")) unused_sources();
    sizes();
    for (auto* list : {&findings_.errors, &findings_.warnings, &findings_.notes})
      std::erase_if(*list, [&](const Error& finding) { return is_unread(finding.field.view()); });
    return std::move(findings_);
  }

 private:
  /// The first of a key: further ones come of it.
  void error(std::string field, std::string requirement) {
    const auto& errors = findings_.errors;
    if (std::none_of(errors.begin(), errors.end(), [&](const Error& e) { return e.field == field; }))
      findings_.errors.push_back({std::move(field), std::move(requirement)});
  }
  void warn(std::string field, std::string text) {
    findings_.warnings.push_back({std::move(field), std::move(text)});
  }

  static bool is_within(std::string_view path, std::string_view outer) {
    return path.starts_with(outer) && (path.size() == outer.size() || path[outer.size()] == '.');
  }
  /// It could not be read, or the table that it is in.
  [[nodiscard]] bool is_unread(std::string_view path) const {
    return std::any_of(origin_.unread.begin(), origin_.unread.end(),
                       [&](const std::string& unread) { return is_within(path, unread); });
  }
  /// All of it is as the file says.
  [[nodiscard]] bool is_read(std::string_view path) const {
    return !is_unread(path) && std::none_of(origin_.unread.begin(), origin_.unread.end(),
                                            [&](const std::string& u) { return is_within(u, path); });
  }
  /// As people have told it.
  [[nodiscard]] std::string told(const std::string& field) const {
    const auto elsewhere = origin_.elsewhere.find(field);
    return elsewhere == origin_.elsewhere.end() ? field : elsewhere->second;
  }

  /// Whether there is none.
  bool table(const std::string& path, std::vector<TableFault> all) {
    const bool sound = all.empty();
    const bool read = is_read(path);
    for (auto& fault : all) {
      if (fault.depends && !read) continue;
      fault.error.field = path + "." + fault.error.field.str();
      findings_.errors.push_back(std::move(fault.error));
    }
    return sound;
  }

  void name(const std::string& path, const std::string& own) {
    if (!is_name(own))
      error(path, fmt::format("found the name {}, required 1 ... 64 letters, digits, '_', '-' and '.'",
                              io::in_quotes(own)));
  }

  /// False where no file is named, too.
  bool readable(const std::string& field, const std::string& file) {
    if (file.empty()) return false;
    std::error_code code;
    const auto path = c_.file(file);
    if (!fs::is_regular_file(path, code))
      error(field, fmt::format("found {}, required a file: there is none of that name",
                               io::in_quotes(path.string())));
    else if (::access(path.c_str(), R_OK) != 0)
      error(field, fmt::format("found {}, which cannot be read", io::in_quotes(path.string())));
    else
      return true;
    return false;
  }

  /// Empty where no file is named or it is refused.
  std::string secret(const std::string& field, const std::string& file, std::size_t least) {
    if (file.empty()) return {};
    const auto path = c_.file(file);
    auto found = read_secret(path, least);
    if (!found) {
      error(field, message_of(found.error()));
      return {};
    }
    struct ::stat facts {};
    if (::stat(path.c_str(), &facts) == 0 && (facts.st_mode & S_IROTH) != 0)
      warn(field, fmt::format("{} can be read by every user of this machine", io::in_quotes(path.string())));
    return std::move(*found);
  }

  /// What the web server would refuse when the former one has ended already.
  void served(const web::WebOptions& options) {
    if (const auto fine = web::check(options); !fine)
      error(fmt::format("monitor.{}_file", fine.error().field.view()), fine.error().requirement.str());
  }

  /// What a server that shows it, or a client, would refuse at its start.
  void certificate(const std::string& path, const std::string& certificate_file,
                   const std::string& key_file) {
    const bool has_certificate = readable(path + ".certificate_file", certificate_file);
    if (!readable(path + ".key_file", key_file) || !has_certificate) return;
    web::WebOptions tls;
    tls.listening.certificate_file = c_.file(certificate_file).string();
    tls.listening.key_file = c_.file(key_file).string();
    const auto fine = web::check(tls);
    if (fine) return;
    const Error& fault = fine.error();
    error(fmt::format("{}.{}", path, fault.field.view()),
          fmt::format("{} {}; required {}", io::in_quotes(fault.where.view()), fault.requirement.view(),
                      fault.field == "key_file" ? "the certificate's key in PEM, without a password"
                                                : "a certificate in PEM"));
  }

  /// As the libraries of MQTT and NATS load it.
  void authorities(const std::string& field, const std::string& file) {
    if (!readable(field, file)) return;
    const std::string path = c_.file(file).string();
    const web::TlsContext context(SSL_CTX_new(TLS_client_method()));
    if (!context || SSL_CTX_load_verify_locations(context.get(), path.c_str(), nullptr) != 1)
      error(field, fmt::format("{} cannot be used; required certificates in PEM", io::in_quotes(path)));
    ERR_clear_error();
  }

  void connection(const std::string& path, const Connection& connection) {
    secret(path + ".password_file", connection.password_file, 1);
    authorities(path + ".ca_file", connection.ca_file);
    certificate(path, connection.certificate_file, connection.key_file);
    const auto server = endpoint(connection.address);
    if (server && !server->is_loopback() && !connection.tls && !connection.password_file.empty())
      warn(path + ".tls", "is false: the password goes over the network in plain text");
  }

  /// A port that is listened at; addresses of one machine may stand for one another.
  void port(const std::string& field, const std::string& protocol, const std::string& address) {
    const auto place = address.starts_with(':') ? listening(address, false) : endpoint(address, 0);
    if (!place || place->port == 0 || is_unread(field)) return;
    const std::string who = ports_.claim(fmt::format("{} {}", protocol, place->port), told(field));
    if (!who.empty())
      error(field, fmt::format("is {} port {}, which {} has already", protocol, place->port, who));
  }

  void service() {
    const auto& m = c_.monitor;
    if (!m.data.empty() && !can_be_made_or_written(c_.file(m.data)))
      error("monitor.data", fmt::format("found {}, required a folder that can be written",
                                        io::in_quotes(c_.file(m.data).string())));
    web::WebOptions tokens;
    tokens.write_token = secret("monitor.write_token_file", m.write_token_file, kShortestToken);
    tokens.read_token = secret("monitor.read_token_file", m.read_token_file, kShortestToken);
    served(tokens);
    certificate("monitor", m.certificate_file, m.key_file);
    port("monitor.listen", "TCP", m.listen);
    const auto place = endpoint(m.listen, 0);
    const bool others_reach = place && !place->is_loopback() && !is_unread("monitor.listen");
    if (others_reach && is_read("monitor")) {
      if (m.write_token_file.empty() && !m.insecure)
        error("monitor.listen",
              fmt::format(
                  "is {}, which others reach: required write_token_file, or insecure = true, in [monitor]",
                  m.listen));
      if (m.certificate_file.empty() && !(m.write_token_file.empty() && m.read_token_file.empty()))
        warn("monitor.listen", "goes without TLS: tokens go over the network in plain text");
    }
    constexpr double kDecade = 10.0 * 365.0 * 86400.0;
    if (m.false_alarm_interval_s > kDecade)
      warn("monitor.false_alarm_interval_s",
           fmt::format(
               "is {:.3g} years: so rare a false alarm asks for changes that are larger or last longer, "
               "and no recording can show that it is kept",
               m.false_alarm_interval_s / (365.0 * 86400.0)));
  }

  void published() {
    const auto& p = c_.publish;
    secret("publish.webhook_token_file", p.webhook_token_file, 1);
    if (p.webhook_url.starts_with("http://") && !p.webhook_token_file.empty())
      warn("publish.webhook_url", "goes without TLS: the token goes over the network in plain text");
    connection("publish.mqtt", p.mqtt.connection);
    connection("publish.nats", p.nats.connection);
    if (!p.mqtt.client_id.empty())
      (void)clients_.claim(p.mqtt.connection.address + " " + p.mqtt.client_id, "publish.mqtt");
  }

  void only_one(const std::string& path, const std::string& key, const std::string& thing) {
    if (const auto who = clients_.claim(thing, path); !who.empty())
      error(path + "." + key, fmt::format("is {}, which {} reads already", thing, who));
  }

  void one_source(const std::string& own, const SourceConfig& s) {
    const std::string path = "source." + own;
    name(path, own);
    table(path, faults(s));
    switch (s.kind) {
      case SourceKind::standard_input:
        return only_one(path, "kind", "stdin");
      case SourceKind::file:  // which may come later
        if (s.path.empty()) return;
        if (std::error_code code; fs::is_directory(c_.file(s.path), code))
          error(path + ".path", fmt::format("found {}, a folder, required a file", io::in_quotes(s.path)));
        else if (!fs::exists(c_.file(s.path), code))
          warn(path + ".path", fmt::format("{} is not there yet", io::in_quotes(c_.file(s.path).string())));
        return;
      case SourceKind::tcp:
      case SourceKind::udp: {
        port(path + ".address", s.kind == SourceKind::tcp ? "TCP" : "UDP", s.connection.address);
        if (const auto place = listening(s.connection.address, s.kind == SourceKind::tcp);
            place && !place->is_loopback())
          warn(path + ".address", "is open to everybody who reaches this machine: they can send samples");
        return;
      }
      case SourceKind::mqtt:
        connection(path, s.connection);
        if (!s.client_id.empty()) {
          const auto who = clients_.claim(s.connection.address + " " + s.client_id, path);
          if (!who.empty())
            error(path + ".client_id",
                  fmt::format("is that of {} at the same broker, which would be thrown out", who));
        }
        if (s.qos == 0) warn(path + ".qos", "is 0: what is sent while nobody listens is lost");
        return;
      case SourceKind::nats:
        connection(path, s.connection);
        if (s.stream.empty())
          warn(path + ".stream", "is not given: what is sent while nobody listens is lost");
        else
          only_one(path, "durable",
                   fmt::format("consumer '{}' of stream '{}' at {}", s.durable.empty() ? own : s.durable,
                               s.stream, s.connection.address));
        return;
      case SourceKind::hal:
        if (std::find(s.columns.begin(), s.columns.end(), kOverrunsColumn) == s.columns.end())
          warn(path + ".columns", "has no 'overruns': samples that the FIFO loses are not counted");
        return only_one(path, "hal_channel", fmt::format("HAL channel {}", s.hal_channel));
      case SourceKind::demo:
        for (const auto& experiment : s.experiments) shipped_or_file(path + ".experiments", experiment);
        return;
    }
  }

  void shipped_or_file(const std::string& field, const std::string& experiment) {
    const auto shipped = io::shipped_experiments();
    if (std::any_of(shipped.begin(), shipped.end(), [&](const auto& s) { return s.name == experiment; }))
      return;
    std::error_code code;
    if (!fs::is_regular_file(c_.file(experiment), code)) {
      std::vector<std::string> names;
      for (const auto& s : shipped) names.emplace_back(s.name);
      findings_.errors.push_back(
          {field, fmt::format("found {}{}, required a shipped experiment or a file",
                              io::in_quotes(experiment), io::suggestion(experiment, names))});
      return;
    }
    if (const auto read = io::read_experiment(c_.file(experiment)); !read)
      findings_.errors.push_back({field, message_of(read.error())});
  }

  void one_axis(const std::string& own, const AxisConfig& a) {
    const std::string path = "axis." + own;
    name(path, own);
    const bool sound = table(path, faults(a));
    const bool sound_alarms = alarms_of_one(path + ".alarms", a.alarms);
    if (!a.source.empty()) belongs(path, own, a);
    if (!tells_controller(a.controller)) readable(path + ".controller", a.controller);
    readable(path + ".start", a.start);
    readable(path + ".baseline", a.baseline);
    if (!sound || !sound_alarms || !is_read(path) || !is_read("alarms")) return;
    without_effect(path + ".alarms", a.alarms, c_.alarms, {&a});
    std::vector<std::string> notes;
    auto spec = axis_spec_of(c_, own, a, 1.0, notes);
    for (auto& note : notes) findings_.notes.push_back({path, std::move(note)});
    if (spec) return;
    for (const auto& fault : spec.error()) error(path + "." + fault.field.str(), fault.requirement.str());
  }

  /// What is wrong with those of all axes is told there.
  bool alarms_of_one(const std::string& path, const monitoring::AxisAlarmSettings& alarms) {
    auto own = alarm_faults(alarms);
    const bool sound = own.empty();
    const auto of_all = sound ? std::vector<TableFault>{} : alarm_faults(c_.alarms);
    std::erase_if(own, [&](const TableFault& fault) {
      return std::any_of(of_all.begin(), of_all.end(), [&](const TableFault& known) {
        return message_of(known.error) == message_of(fault.error);
      });
    });
    table(path, std::move(own));
    return sound;
  }

  void alarms_of_all() {
    std::vector<const AxisConfig*> axes;
    for (const auto& [name, axis] : c_.axes.tables) axes.push_back(&axis);
    if (!axes.empty()) without_effect("alarms", c_.alarms, standard_alarms(), axes);
  }

  /// What an axis may lack of a figure: then its rows never have it.
  struct Needed {
    bool (*has)(const AxisConfig&);
    std::string_view name;
  };
  static std::optional<Needed> needed_for(monitoring::Watched figure) {
    using identification::Friction;
    using identification::TrackMethod;
    using monitoring::Watched;
    switch (figure) {
      case Watched::modulus_margin:
      case Watched::phase_margin:
        return Needed{[](const AxisConfig& a) { return !a.controller.empty(); }, "a controller"};
      case Watched::gap:
        return Needed{[](const AxisConfig& a) { return !a.baseline.empty(); }, "a baseline"};
      case Watched::coulomb_friction:
        return Needed{
            [](const AxisConfig& a) { return a.friction == Friction::dry || a.friction == Friction::both; },
            "friction = \"dry\" or \"both\""};
      case Watched::stiffness:
      case Watched::driven_inertia:
      case Watched::load_inertia:
      case Watched::damping:
      case Watched::load_torque:  // what the physical tracker alone estimates
        return Needed{[](const AxisConfig& a) {
                        return a.method == TrackMethod::automatic || a.method == TrackMethod::physical;
                      },
                      "method = \"auto\" or \"physical\""};
      case Watched::resonance:
      case Watched::antiresonance:
        break;
    }
    return std::nullopt;
  }

  /// Refuses what `alarms` says other than `usual` and none of `axes` can obey: limits of a figure that it
  /// does not have, a deadband without limits. Warns of what else it says of such a figure.
  void without_effect(const std::string& path, const monitoring::AxisAlarmSettings& alarms,
                      const monitoring::AxisAlarmSettings& usual,
                      const std::vector<const AxisConfig*>& axes) {
    const auto any = [&](const auto& has) { return std::any_of(axes.begin(), axes.end(), has); };
    const auto is_limited = [](const monitoring::FigureAlarmSettings& f) {
      return std::isfinite(f.low) || std::isfinite(f.high);
    };
    for (const auto& [figure, own_name] : monitoring::kWatchedNames) {
      std::string name = path + '.' + std::string(own_name);
      std::replace(name.begin() + static_cast<std::ptrdiff_t>(path.size()), name.end(), '-', '_');
      const auto &own = alarms[figure], &other = usual[figure];
      const auto needed = needed_for(figure);
      if (needed && !any([&](const AxisConfig* a) { return needed->has(*a); })) {
        const std::string needs = fmt::format("needs an axis with {}: without one this ", needed->name);
        const bool low = std::isfinite(own.low) && own.low != other.low;
        const bool high = std::isfinite(own.high) && own.high != other.high;
        if (low) error(name + ".low", needs + "limit is never judged");
        if (high) error(name + ".high", needs + "limit is never judged");
        if (!low && !high && own.alarm.enabled && !(own == other)) warn(name, needs + "alarm never comes");
      }
      const bool limited = any([&, f = figure](const AxisConfig* a) { return is_limited(a->alarms[f]); });
      if (own.deadband > 0.0 && own.deadband != other.deadband && !limited)
        error(name + ".deadband", "needs low or high");
    }
  }

  void belongs(const std::string& path, const std::string& own, const AxisConfig& a) {
    used_.insert(a.source);
    if (!is_read("source." + a.source)) return;
    const auto source = c_.sources.tables.find(a.source);
    if (source == c_.sources.tables.end()) {
      std::vector<std::string> names;
      for (const auto& [known, config] : c_.sources.tables) names.push_back(known);
      return error(path + ".source", fmt::format("found {}{}, required the name of a source; there are: {}",
                                                 io::in_quotes(a.source), io::suggestion(a.source, names),
                                                 names.empty() ? "none" : io::listed(names)));
    }
    const std::string& channel = a.channel.empty() ? own : a.channel;
    if (is_unread(path + ".channel")) return;
    const std::string who = channels_.claim(a.source + '\n' + channel, path);
    if (!who.empty())
      error(path + ".channel", fmt::format("is {} of source {}, which is {} already", io::in_quotes(channel),
                                           io::in_quotes(a.source), who));
    if (source->second.kind == SourceKind::demo) {
      std::vector<std::string> drives;
      for (const auto& experiment : source->second.experiments) drives.push_back(demo_axis(experiment));
      if (std::find(drives.begin(), drives.end(), channel) == drives.end())
        error(path + ".channel",
              fmt::format("found {}{}, required an experiment of source {}: {}", io::in_quotes(channel),
                          io::suggestion(channel, drives), io::in_quotes(a.source), io::listed(drives)));
    }
    const auto& columns = columns_of(source->second);
    for (const auto& [key, column] :
         {std::pair{"input", &a.input}, std::pair{"output", &a.output},
          std::pair{"excitation", &a.excitation}, std::pair{"position", &a.position}})
      if (const auto count = std::count(columns.begin(), columns.end(), *column);
          !column->empty() && !columns.empty() && count != 1) {
        std::string text =
            fmt::format("found {}{}, required {} column of source {}: {}", io::in_quotes(*column),
                        count == 0 ? io::suggestion(*column, columns) : ", the name of several",
                        count == 0 ? "a" : "one", io::in_quotes(a.source), io::listed(columns));
        // What a file has now it need not have tomorrow.
        if (source->second.columns.empty())
          warn(path + "." + key, std::move(text));
        else
          error(path + "." + key, std::move(text));
      }
  }

  /// As told, else as a file that is there tells them; empty: they are not known beforehand.
  const std::vector<std::string>& columns_of(const SourceConfig& s) {
    const bool in_file = s.kind == SourceKind::file && s.format == SampleFormat::csv && !s.path.empty();
    if (!in_file || !s.columns.empty()) return s.columns;
    const auto [place, is_new] = columns_.try_emplace(s.path);
    if (is_new) place->second = columns_in(c_.file(s.path));
    return place->second;
  }

  void unused_sources() {
    for (const auto& [own, source] : c_.sources.tables)
      if (!used_.contains(own)) warn("source." + own, "is read by no axis");
  }

  /// Rings are made at once, in full.
  void sizes() {
    double bytes = 0.0;
    for (const auto& [own, a] : c_.axes.tables) {
      const double channels = 2.0 + (a.excitation.empty() ? 0.0 : 1.0) + (a.position.empty() ? 0.0 : 1.0);
      bytes += a.ring_s * a.sample_rate_hz * channels * sizeof(double);
    }
    const auto& errors = findings_.errors;
    if (std::any_of(errors.begin(), errors.end(), [](const Error& e) { return e.field == "monitor.data"; }))
      return;
    std::error_code code;
    fs::path folder = fs::absolute(c_.file(c_.monitor.data), code);
    while (!fs::exists(folder, code) && folder.has_relative_path()) folder = folder.parent_path();
    const auto space = fs::space(folder, code);
    if (!code && bytes > static_cast<double>(space.available))
      warn("monitor.data", fmt::format("has room for {:.3g} MB, and the rings of all axes take {:.3g} MB",
                                       1e-6 * static_cast<double>(space.available), 1e-6 * bytes));
  }

  const Configuration& c_;
  const Origin& origin_;
  Findings findings_;
  Claims ports_, clients_, channels_;
  std::set<std::string> used_;                               ///< Sources.
  std::map<std::string, std::vector<std::string>> columns_;  ///< By file.
};

}  // namespace

expected<std::string, Error> read_secret(const std::filesystem::path& path, std::size_t least) {
  const auto refused = [&](std::string_view what) {
    return refuse("", fmt::format("{} {}", io::in_quotes(path.string()), what));
  };
  std::error_code code;
  if (!fs::is_regular_file(path, code)) return refused("is no file");
  std::ifstream stream(path, std::ios::binary);
  std::string line;
  if (!stream) return refused("cannot be read");
  constexpr std::size_t kLongest = 4096;
  line.resize(kLongest);
  stream.read(line.data(), static_cast<std::streamsize>(kLongest));
  line.resize(static_cast<std::size_t>(stream.gcount()));
  line = line.substr(0, line.find('\n'));
  constexpr std::string_view kBlank = " \t\r";
  const auto first = line.find_first_not_of(kBlank);
  line = first == line.npos ? "" : line.substr(first, line.find_last_not_of(kBlank) - first + 1);
  if (line.size() < least)
    return refused(
        fmt::format("has {} characters in its first line, required at least {}", line.size(), least));
  return line;
}

std::string axis_name(std::string_view text) {
  constexpr std::size_t kLongest = 56;
  std::string name(text.substr(0, kLongest));
  std::replace_if(
      name.begin(), name.end(), [](char c) { return !is_name_character(c); }, '-');
  return name.empty() ? "axis" : name;
}

Findings check(const Configuration& configuration, const Origin& origin) {
  return Checker(configuration, origin).all();
}

}  // namespace resonid::monitor
