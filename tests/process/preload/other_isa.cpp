// Preloaded into the command, makes Embree use the instruction set named by LUCERNA_TEST_ISA. It writes the
// requested and the chosen one to the file LUCERNA_TEST_NOTE, which proves that it was loaded.
#include <dlfcn.h>

#include <cstdlib>
#include <fstream>
#include <string>

extern "C" void* rtcNewDevice(const char* config) {
    using NewDevice = void* (*)(const char*);
    const auto embrees = reinterpret_cast<NewDevice>(dlsym(RTLD_NEXT, "rtcNewDevice"));
    const char* const isa = std::getenv("LUCERNA_TEST_ISA");
    const char* const note = std::getenv("LUCERNA_TEST_NOTE");
    if (embrees == nullptr || isa == nullptr || note == nullptr) std::abort();
    std::string changed(config);
    const std::size_t at = changed.find(",isa=");
    if (at != std::string::npos) changed.erase(at, changed.find(',', at + 1) - at);
    changed += std::string(",isa=") + isa;
    std::ofstream(note, std::ios::app) << config << " -> " << changed << "\n";
    return embrees(changed.c_str());
}
