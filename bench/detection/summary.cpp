// SPDX-License-Identifier: Apache-2.0
#include "summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <vector>

#include "cases.h"
#include "statistics.h"

namespace asbuilt::bench {
namespace {

using Json = nlohmann::ordered_json;
using Records = std::vector<CaseRecord>;
using Predicate = std::function<bool(const CaseRecord&)>;

Records filtered(std::span<const CaseRecord> records, const Predicate& wanted) {
  Records some;
  std::ranges::copy_if(records, std::back_inserter(some), wanted);
  return some;
}

Json share(std::size_t hits, std::size_t trials) {
  const Interval interval = wilson_interval(hits, trials);
  return {{"hits", hits},
          {"of", trials},
          {"share", trials > 0 ? Json(static_cast<double>(hits) / static_cast<double>(trials)) : Json(nullptr)},
          {"low", interval.low},
          {"high", interval.high}};
}

std::size_t count(const Records& records, const Predicate& wanted) {
  return static_cast<std::size_t>(std::ranges::count_if(records, wanted));
}

Json recall(const Records& records) {
  const Records present = filtered(records, &CaseRecord::present);
  return share(count(present, &CaseRecord::found), present.size());
}

Json times(const Records& records) {
  const auto told = [&](const char* name, const std::function<double(const CaseRecord&)>& seconds) {
    std::vector<double> values;
    for (const CaseRecord& record : records) values.push_back(seconds(record));
    return Json{{"step", name}, {"median", percentile(values, 0.5)}, {"p95", percentile(values, 0.95)}};
  };
  return {told("prepare scan", [](const CaseRecord& r) { return r.prepare_scan.wall; }),
          told("detect", [](const CaseRecord& r) { return r.detect.wall; }),
          told("verify", [](const CaseRecord& r) { return r.verify.wall; }), told("all", &CaseRecord::seconds),
          told("all, processor", &CaseRecord::cpu_seconds)};
}

// Once a part, however many of its scans there are.
Json prepare_model(const Records& records) {
  std::map<std::string, double> seconds;
  for (const CaseRecord& record : records) seconds[record.part] = record.prepare_model.wall;
  std::vector<double> values;
  for (const auto& [part, value] : seconds) values.push_back(value);
  return {{"median", percentile(values, 0.5)}, {"worst", percentile(values, 1.0)}};
}

Json named(const CaseRecord& record) {
  Json json{{"seed", record.seed},         {"part", record.part},     {"content", record.content},
            {"hidden", record.hidden},     {"sensor", record.sensor}, {"status", record.status},
            {"reason", record.reason_code}};
  json["best_is_right"] = record.best.right;
  json["displacement"] = record.best.displacement ? Json(*record.best.displacement) : Json(nullptr);
  json["right_rank"] = record.right_rank ? Json(*record.right_rank) : Json(nullptr);
  json["explanation"] = record.reason;
  return json;
}

Json figures(const Records& records) {
  Json json;
  json["scans"] = records.size();
  json["precision"] = share(count(records, &CaseRecord::found), count(records, &CaseRecord::accepted));
  json["recall"] = recall(records);
  for (const Stratum& stratum : kStrata) {
    json["recall_by_hidden"][stratum.name] =
        recall(filtered(records, [&](const CaseRecord& r) { return r.stratum == stratum.name; }));
  }
  const Records outside = filtered(records, [](const CaseRecord& r) { return r.stratum == "outside"; });
  if (!outside.empty()) json["recall_by_hidden"]["outside"] = recall(outside);
  // How far detection alone gets: some hypothesis near the truth reaches verification.
  const Records present = filtered(records, &CaseRecord::present);
  json["proposed"] =
      share(count(present, [](const CaseRecord& r) { return r.right_rank.has_value(); }), present.size());

  std::set<std::string> parts, sensors, decoys;
  for (const CaseRecord& record : records) {
    parts.insert(record.part);
    sensors.insert(record.sensor);
    if (!record.present()) decoys.insert(record.content);
  }
  for (const std::string& sensor : sensors) {
    json["recall_by_sensor"][sensor] =
        recall(filtered(records, [&](const CaseRecord& r) { return r.sensor == sensor; }));
  }
  for (const std::string& part : parts) {
    const Records own = filtered(records, [&](const CaseRecord& r) { return r.part == part; });
    Json& entry = json["parts"][part] = recall(own);
    entry["wrong"] = count(own, &CaseRecord::wrong);
    entry["scans"] = own.size();
  }
  for (const std::string& decoy : decoys) {
    const Records own = filtered(records, [&](const CaseRecord& r) { return r.content == decoy; });
    json["without_the_part"][decoy] = share(count(own, &CaseRecord::accepted), own.size());
  }
  json["seconds"] = times(records);
  json["prepare_model"] = prepare_model(records);
  json["wrong"] = Json::array();
  json["missed"] = Json::array();
  for (const CaseRecord& record : records) {
    if (record.wrong()) json["wrong"].push_back(named(record));
    if (record.present() && !record.accepted()) json["missed"].push_back(named(record));
  }
  return json;
}

std::string percent(const Json& share) {
  if (share.at("share").is_null()) return "-";
  return fmt::format("{} of {}, {:.1f} % ({:.1f} to {:.1f})", share.at("hits").get<std::size_t>(),
                     share.at("of").get<std::size_t>(), 100.0 * share.at("share").get<double>(),
                     100.0 * share.at("low").get<double>(), 100.0 * share.at("high").get<double>());
}

std::string row(const std::string& name, const Json& share) {
  return fmt::format("| {} | {} |\n", name, percent(share));
}

std::string line_of(const Json& json) {
  const auto number = [](const Json& value, int digits) {
    return value.is_null() ? std::string("-") : fmt::format("{:.{}f}", value.get<double>(), digits);
  };
  return fmt::format("| {} | {} | {} | {} | {} | {} | {} | {} | {} |\n", json.at("seed").get<std::uint64_t>(),
                     json.at("part").get<std::string>(), json.at("content").get<std::string>(),
                     number(json.at("hidden"), 2), json.at("sensor").get<std::string>(),
                     json.at("reason").get<std::string>(), json.at("best_is_right").get<bool>() ? "yes" : "no",
                     number(json.at("displacement"), 3), number(json.at("right_rank"), 0));
}

std::string list_of(const std::string& title, const Json& cases) {
  if (cases.empty()) return "";
  std::string text = fmt::format(
      "\n| {} | part | shown | hidden | sensor | reason | best is right | displacement | first right hypothesis "
      "|\n|---|---|---|---|---|---|---|---|---|\n",
      title);
  for (const Json& json : cases) text += line_of(json);
  return text;
}

std::string section(const std::string& title, const Json& json) {
  std::string text = fmt::format("\n### {}\n\n| {} scans | hits, share, Wilson 95 % |\n|---|---|\n", title,
                                 json.at("scans").get<std::size_t>());
  text += row("precision", json.at("precision")) + row("recall", json.at("recall"));
  for (const auto& [name, entry] : json.at("recall_by_hidden").items()) text += row("recall, hidden " + name, entry);
  for (const auto& [name, entry] : json.at("recall_by_sensor").items()) text += row("recall, " + name, entry);
  text += row("right pose among the hypotheses", json.at("proposed"));
  if (json.contains("without_the_part")) {
    for (const auto& [name, entry] : json.at("without_the_part").items()) {
      text += row("accepted without the part: " + name, entry);
    }
  }
  text += "\n| part | recall | wrong |\n|---|---|---|\n";
  for (const auto& [name, entry] : json.at("parts").items()) {
    text += fmt::format("| {} | {} | {} |\n", name, percent(entry), entry.at("wrong").get<std::size_t>());
  }
  text += "\n| seconds a scan | median | p95 |\n|---|---|---|\n";
  for (const Json& time : json.at("seconds")) {
    text += fmt::format("| {} | {:.2f} | {:.2f} |\n", time.at("step").get<std::string>(),
                        time.at("median").get<double>(), time.at("p95").get<double>());
  }
  const Json& preparation = json.at("prepare_model");
  text += fmt::format("| preparing a model (worst in place of p95) | {:.2f} | {:.2f} |\n",
                      preparation.at("median").get<double>(), preparation.at("worst").get<double>());
  return text + list_of("wrong: seed", json.at("wrong")) + list_of("missed: seed", json.at("missed"));
}

// The modes on the scans that all of them have taken.
Json comparison(const Records& records) {
  std::set<std::string> modes;
  std::map<std::uint64_t, std::size_t> taken;
  for (const CaseRecord& record : records) {
    modes.insert(record.mode);
    ++taken[record.seed];
  }
  Json json = Json::object();
  if (modes.size() < 2) return json;
  for (const std::string& mode : modes) {
    const Records own =
        filtered(records, [&](const CaseRecord& r) { return r.mode == mode && taken.at(r.seed) == modes.size(); });
    if (own.empty()) return Json::object();
    Json entry = figures(own);
    entry.erase("wrong");
    entry.erase("missed");
    json[mode] = std::move(entry);
  }
  return json;
}

std::string comparison_table(const std::string& group, const Json& modes) {
  std::string text = fmt::format(
      "\n### The same scans, {} parts\n\n| mode | scans | recall | precision | median s | p95 s | preparing a model, "
      "median s | worst s |\n|---|---|---|---|---|---|---|---|\n",
      group);
  for (const auto& [mode, entry] : modes.items()) {
    const Json& all = entry.at("seconds").at(3);
    text += fmt::format("| {} | {} | {} | {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} |\n", mode,
                        entry.at("scans").get<std::size_t>(), percent(entry.at("recall")),
                        percent(entry.at("precision")), all.at("median").get<double>(), all.at("p95").get<double>(),
                        entry.at("prepare_model").at("median").get<double>(),
                        entry.at("prepare_model").at("worst").get<double>());
  }
  return text;
}

}  // namespace

Json summary_of(std::span<const CaseRecord> records) {
  std::set<std::pair<std::string, std::string>> sections;
  for (const CaseRecord& record : records) sections.emplace(record.mode, record.group);
  Json json{{"modes", Json::object()}, {"same_scans", Json::object()}};
  for (const auto& [mode, group] : sections) {
    json["modes"][mode][group] =
        figures(filtered(records, [&](const CaseRecord& r) { return r.mode == mode && r.group == group; }));
    json["same_scans"][group] = comparison(filtered(records, [&](const CaseRecord& r) { return r.group == group; }));
  }
  return json;
}

std::string tables(const Json& summary) {
  std::string text;
  for (const auto& [mode, groups] : summary.at("modes").items()) {
    for (const auto& [group, figures] : groups.items()) {
      text += section(fmt::format("{}, {} parts", mode, group), figures);
    }
  }
  for (const auto& [group, modes] : summary.at("same_scans").items()) {
    if (!modes.empty()) text += comparison_table(group, modes);
  }
  return text;
}

}  // namespace asbuilt::bench
