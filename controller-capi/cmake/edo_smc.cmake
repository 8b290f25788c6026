# Target edo_smc::edo_smc for the core of this build, and edo_smc_export for an exported C99 file.
set(EDO_SMC_CORES thumbv6m thumbv7m thumbv7em thumbv8m host)

# Sets `chosen` to the core, or `problem` to an error. Order: EDO_SMC_CORE; host without cross-compiling; -mcpu and
# -mfloat-abi of the compiler flags, or CMAKE_SYSTEM_PROCESSOR in place of -mcpu.
function(edo_smc_choose_core chosen problem)
    string(REPLACE ";" ", " choices "${EDO_SMC_CORES}")
    set(${problem} "" PARENT_SCOPE)
    if(EDO_SMC_CORE)
        if(NOT EDO_SMC_CORE IN_LIST EDO_SMC_CORES)
            set(${problem} "EDO_SMC_CORE = ${EDO_SMC_CORE}: must be one of ${choices}. Set -DEDO_SMC_CORE=thumbv7em for \
a Cortex-M4F." PARENT_SCOPE)
        endif()
        set(${chosen} ${EDO_SMC_CORE} PARENT_SCOPE)
        return()
    endif()
    if(NOT CMAKE_CROSSCOMPILING)
        set(${chosen} host PARENT_SCOPE)
        return()
    endif()
    get_directory_property(options COMPILE_OPTIONS)
    # A build without C, such as this package's own, has the flags of the toolchain file only.
    set(flags "${CMAKE_C_FLAGS_INIT} ${CMAKE_C_FLAGS} ${CMAKE_CXX_FLAGS_INIT} ${CMAKE_CXX_FLAGS} ${options}")
    set(cpu "${CMAKE_SYSTEM_PROCESSOR}")
    if(flags MATCHES "-mcpu=([A-Za-z0-9.-]+)")
        set(cpu ${CMAKE_MATCH_1})
    endif()
    set(abi unset)
    if(flags MATCHES "-mfloat-abi=([a-z]+)")
        set(abi ${CMAKE_MATCH_1})
    endif()
    string(TOLOWER "${cpu}" cpu)
    set(core)
    if(cpu MATCHES "^(cortex-m0|cortex-m0plus|cortex-m1|armv6s?-m)$")
        set(core thumbv6m)
    elseif(cpu MATCHES "^(cortex-m3|armv7-m)$")
        set(core thumbv7m)
    elseif(cpu MATCHES "^(cortex-m4|cortex-m7|armv7e-m)$")
        # The archive for hard floats passes them in registers of the FPU; soft and softfp do not.
        if(abi STREQUAL "hard")
            set(core thumbv7em)
        elseif(NOT abi STREQUAL "unset")
            set(core thumbv7m)
        endif()
    elseif(cpu MATCHES "^(cortex-m33|armv8-m.main)$" AND abi STREQUAL "hard")
        set(core thumbv8m)
    endif()
    if(NOT core)
        set(${problem} "EDO_SMC_CORE is not set, and no archive follows from cpu = ${cpu} with -mfloat-abi ${abi}. Set \
-DEDO_SMC_CORE=CORE with one of ${choices}. For another core use the exported C99 file." PARENT_SCOPE)
    endif()
    set(${chosen} "${core}" PARENT_SCOPE)
endfunction()

# Defines edo_smc::edo_smc from a folder with one subfolder per core; sets `problem` to an error.
function(edo_smc_define archives include problem)
    set(${problem} "" PARENT_SCOPE)
    if(TARGET edo_smc::edo_smc)
        return()
    endif()
    edo_smc_choose_core(core found)
    if(NOT found AND NOT EXISTS ${archives}/${core}/libedo_smc.a)
        set(found "${archives}/${core}/libedo_smc.a: missing. Build it in the folder of edo-smc: cargo xtask capi")
    endif()
    if(found)
        set(${problem} "${found}" PARENT_SCOPE)
        return()
    endif()
    add_library(edo_smc::edo_smc STATIC IMPORTED GLOBAL)
    set_target_properties(edo_smc::edo_smc PROPERTIES
        IMPORTED_LOCATION ${archives}/${core}/libedo_smc.a
        IMPORTED_LINK_INTERFACE_LANGUAGES C
        INTERFACE_INCLUDE_DIRECTORIES ${include})
endfunction()

# edo_smc_export(TARGET target SCENARIO mine.toml [PREFIX prefix] [CONFIG])
#
# Exports a scenario to mine_drive.h when the scenario changes; the target then includes "mine_drive.h". It needs the
# program host-sim on this PC and no archive. With CONFIG it writes mine_config.h, the configuration for the static
# library.
function(edo_smc_export)
    cmake_parse_arguments(PARSE_ARGV 0 arg "CONFIG" "TARGET;SCENARIO;PREFIX" "")
    if(NOT arg_TARGET OR NOT arg_SCENARIO OR arg_UNPARSED_ARGUMENTS)
        message(FATAL_ERROR "edo_smc_export: write edo_smc_export(TARGET target SCENARIO mine.toml [PREFIX prefix] \
[CONFIG])")
    endif()
    find_program(EDO_SMC_HOST_SIM host-sim)
    if(NOT EDO_SMC_HOST_SIM)
        message(FATAL_ERROR "edo_smc_export: no program host-sim. Install it in the folder of edo-smc with \
`cargo install --path host-sim`, or set -DEDO_SMC_HOST_SIM=PATH.")
    endif()
    get_filename_component(scenario ${arg_SCENARIO} ABSOLUTE)
    get_filename_component(name ${scenario} NAME_WE)
    set(form --standalone)
    set(file ${name}_drive.h)
    set(prefix edo_smc)
    if(arg_CONFIG)
        set(form)
        set(file ${name}_config.h)
        set(prefix my)
    endif()
    if(arg_PREFIX)
        set(prefix ${arg_PREFIX})
    endif()
    set(folder ${CMAKE_CURRENT_BINARY_DIR}/edo_smc/${arg_TARGET})
    file(MAKE_DIRECTORY ${folder})
    add_custom_command(OUTPUT ${folder}/${file}
        COMMAND ${EDO_SMC_HOST_SIM} export ${scenario} --lang c ${form} --prefix ${prefix} -o ${folder}/${file} --force
        DEPENDS ${scenario} ${EDO_SMC_HOST_SIM} COMMENT "Exporting ${file}" VERBATIM)
    target_sources(${arg_TARGET} PRIVATE ${folder}/${file})
    target_include_directories(${arg_TARGET} PRIVATE ${folder})
endfunction()
