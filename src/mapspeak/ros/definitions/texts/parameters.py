"""The parameters of a node of ROS 2, and the services that every node has for them."""

__all__ = ["PARAMETERS"]

PARAMETERS = """
MSG: rcl_interfaces/ParameterValue
uint8 type
bool bool_value
int64 integer_value
float64 double_value
string string_value
byte[] byte_array_value
bool[] bool_array_value
int64[] integer_array_value
float64[] double_array_value
string[] string_array_value

MSG: rcl_interfaces/Parameter
string name
rcl_interfaces/ParameterValue value

MSG: rcl_interfaces/FloatingPointRange
float64 from_value
float64 to_value
float64 step

MSG: rcl_interfaces/IntegerRange
int64 from_value
int64 to_value
uint64 step

MSG: rcl_interfaces/ParameterDescriptor
string name
uint8 type
string description
string additional_constraints
bool read_only false
bool dynamic_typing false
rcl_interfaces/FloatingPointRange[<=1] floating_point_range
rcl_interfaces/IntegerRange[<=1] integer_range

MSG: rcl_interfaces/ListParametersResult
string[] names
string[] prefixes

MSG: rcl_interfaces/SetParametersResult
bool successful
string reason

MSG: rcl_interfaces/ParameterEvent
builtin_interfaces/Time stamp
string node
rcl_interfaces/Parameter[] new_parameters
rcl_interfaces/Parameter[] changed_parameters
rcl_interfaces/Parameter[] deleted_parameters

SRV: rcl_interfaces/ListParameters
uint64 DEPTH_RECURSIVE=0
string[] prefixes
uint64 depth
---
rcl_interfaces/ListParametersResult result

SRV: rcl_interfaces/GetParameters
string[] names
---
rcl_interfaces/ParameterValue[] values

SRV: rcl_interfaces/GetParameterTypes
string[] names
---
uint8[] types

SRV: rcl_interfaces/DescribeParameters
string[] names
---
rcl_interfaces/ParameterDescriptor[] descriptors

SRV: rcl_interfaces/SetParameters
rcl_interfaces/Parameter[] parameters
---
rcl_interfaces/SetParametersResult[] results

SRV: rcl_interfaces/SetParametersAtomically
rcl_interfaces/Parameter[] parameters
---
rcl_interfaces/SetParametersResult result
"""
