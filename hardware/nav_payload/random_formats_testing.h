#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

#include "hardware/nav_payload/bluefin_sentences.h"
#include "hardware/nav_payload/can_records.h"
#include "hardware/nav_payload/hg1700.h"
#include "hardware/nav_payload/pd0.h"
#include "hardware/nav_payload/pd45.h"
#include "hardware/nav_payload/pd6.h"
#include "lib/base/random.h"

namespace vog {

/// Random valid content of every format, for round trips and for the fuzzer.

Sentence RandomSentence(int seed);
Pd0Ensemble RandomPd0(int seed);
Pd45Ensemble RandomPd45(int seed);
Pd6Ensemble RandomPd6(int seed);
Hg1700Record RandomHg1700(int seed);
CanRecord RandomCanRecord(int seed);
VehicleNavRecord RandomVehicleNav(int seed);

/// The file of the folder of recordings, $VOG_SHARED_DATA or ../shared/data beside the source tree;
/// nothing where it is not there.
std::optional<std::filesystem::path> FindRecording(const std::string& name);

}  // namespace vog
