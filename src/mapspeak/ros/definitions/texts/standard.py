"""Time, plain values, switches and what a node says of itself."""

__all__ = ["STANDARD"]

STANDARD = """
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec

MSG: builtin_interfaces/Duration
int32 sec
uint32 nanosec

MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id

MSG: std_msgs/Bool
bool data

MSG: std_msgs/Byte
byte data

MSG: std_msgs/Char
char data

MSG: std_msgs/ColorRGBA
float32 r
float32 g
float32 b
float32 a

MSG: std_msgs/Empty

MSG: std_msgs/Float32
float32 data

MSG: std_msgs/Float64
float64 data

MSG: std_msgs/Int8
int8 data

MSG: std_msgs/Int16
int16 data

MSG: std_msgs/Int32
int32 data

MSG: std_msgs/Int64
int64 data

MSG: std_msgs/UInt8
uint8 data

MSG: std_msgs/UInt16
uint16 data

MSG: std_msgs/UInt32
uint32 data

MSG: std_msgs/UInt64
uint64 data

MSG: std_msgs/String
string data

MSG: std_msgs/MultiArrayDimension
string label
uint32 size
uint32 stride

MSG: std_msgs/MultiArrayLayout
std_msgs/MultiArrayDimension[] dim
uint32 data_offset

MSG: std_msgs/Float32MultiArray
std_msgs/MultiArrayLayout layout
float32[] data

MSG: std_msgs/Float64MultiArray
std_msgs/MultiArrayLayout layout
float64[] data

MSG: std_msgs/Int16MultiArray
std_msgs/MultiArrayLayout layout
int16[] data

MSG: std_msgs/Int32MultiArray
std_msgs/MultiArrayLayout layout
int32[] data

MSG: std_msgs/UInt8MultiArray
std_msgs/MultiArrayLayout layout
uint8[] data

SRV: std_srvs/Empty
---

SRV: std_srvs/SetBool
bool data
---
bool success
string message

SRV: std_srvs/Trigger
---
bool success
string message

MSG: rosgraph_msgs/Clock
builtin_interfaces/Time clock

MSG: rosgraph_msgs/Log
byte DEBUG=1
byte INFO=2
byte WARN=4
byte ERROR=8
byte FATAL=16
std_msgs/Header header
byte level
string name
string msg
string file
string function
uint32 line
string[] topics

MSG: rcl_interfaces/Log
uint8 DEBUG=10
uint8 INFO=20
uint8 WARN=30
uint8 ERROR=40
uint8 FATAL=50
builtin_interfaces/Time stamp
uint8 level
string name
string msg
string file
string function
uint32 line

MSG: diagnostic_msgs/KeyValue
string key
string value

MSG: diagnostic_msgs/DiagnosticStatus
byte OK=0
byte WARN=1
byte ERROR=2
byte STALE=3
byte level
string name
string message
string hardware_id
diagnostic_msgs/KeyValue[] values

MSG: diagnostic_msgs/DiagnosticArray
std_msgs/Header header
diagnostic_msgs/DiagnosticStatus[] status

MSG: lifecycle_msgs/State
uint8 PRIMARY_STATE_UNKNOWN=0
uint8 PRIMARY_STATE_UNCONFIGURED=1
uint8 PRIMARY_STATE_INACTIVE=2
uint8 PRIMARY_STATE_ACTIVE=3
uint8 PRIMARY_STATE_FINALIZED=4
uint8 TRANSITION_STATE_CONFIGURING=10
uint8 TRANSITION_STATE_CLEANINGUP=11
uint8 TRANSITION_STATE_SHUTTINGDOWN=12
uint8 TRANSITION_STATE_ACTIVATING=13
uint8 TRANSITION_STATE_DEACTIVATING=14
uint8 TRANSITION_STATE_ERRORPROCESSING=15
uint8 id
string label

MSG: lifecycle_msgs/Transition
uint8 TRANSITION_CREATE=0
uint8 TRANSITION_CONFIGURE=1
uint8 TRANSITION_CLEANUP=2
uint8 TRANSITION_ACTIVATE=3
uint8 TRANSITION_DEACTIVATE=4
uint8 TRANSITION_UNCONFIGURED_SHUTDOWN=5
uint8 TRANSITION_INACTIVE_SHUTDOWN=6
uint8 TRANSITION_ACTIVE_SHUTDOWN=7
uint8 TRANSITION_DESTROY=8
uint8 TRANSITION_ON_CONFIGURE_SUCCESS=10
uint8 TRANSITION_ON_CONFIGURE_FAILURE=11
uint8 TRANSITION_ON_CONFIGURE_ERROR=12
uint8 TRANSITION_ON_CLEANUP_SUCCESS=20
uint8 TRANSITION_ON_CLEANUP_FAILURE=21
uint8 TRANSITION_ON_CLEANUP_ERROR=22
uint8 TRANSITION_ON_ACTIVATE_SUCCESS=30
uint8 TRANSITION_ON_ACTIVATE_FAILURE=31
uint8 TRANSITION_ON_ACTIVATE_ERROR=32
uint8 TRANSITION_ON_DEACTIVATE_SUCCESS=40
uint8 TRANSITION_ON_DEACTIVATE_FAILURE=41
uint8 TRANSITION_ON_DEACTIVATE_ERROR=42
uint8 TRANSITION_ON_SHUTDOWN_SUCCESS=50
uint8 TRANSITION_ON_SHUTDOWN_FAILURE=51
uint8 TRANSITION_ON_SHUTDOWN_ERROR=52
uint8 TRANSITION_ON_ERROR_SUCCESS=60
uint8 TRANSITION_ON_ERROR_FAILURE=61
uint8 TRANSITION_ON_ERROR_ERROR=62
uint8 TRANSITION_CALLBACK_SUCCESS=97
uint8 TRANSITION_CALLBACK_FAILURE=98
uint8 TRANSITION_CALLBACK_ERROR=99
uint8 id
string label

MSG: lifecycle_msgs/TransitionDescription
lifecycle_msgs/Transition transition
lifecycle_msgs/State start_state
lifecycle_msgs/State goal_state

MSG: lifecycle_msgs/TransitionEvent
uint64 timestamp
lifecycle_msgs/Transition transition
lifecycle_msgs/State start_state
lifecycle_msgs/State goal_state

SRV: lifecycle_msgs/ChangeState
lifecycle_msgs/Transition transition
---
bool success

SRV: lifecycle_msgs/GetState
---
lifecycle_msgs/State current_state

SRV: lifecycle_msgs/GetAvailableStates
---
lifecycle_msgs/State[] available_states

SRV: lifecycle_msgs/GetAvailableTransitions
---
lifecycle_msgs/TransitionDescription[] available_transitions
"""
