"""The services of rosapi, which tells what a robot is made of; ROS 1 has them in package rosapi."""

__all__ = ["ROSAPI"]

ROSAPI = """
MSG: rosapi_msgs/TypeDef
string type
string[] fieldnames
string[] fieldtypes
int32[] fieldarraylen
string[] examples
string[] constnames
string[] constvalues

SRV: rosapi_msgs/Topics
---
string[] topics
string[] types

SRV: rosapi_msgs/TopicsForType
string type
---
string[] topics

SRV: rosapi_msgs/TopicsAndRawTypes
---
string[] topics
string[] types
string[] typedefs_full_text

SRV: rosapi_msgs/TopicType
string topic
---
string type

SRV: rosapi_msgs/Publishers
string topic
---
string[] publishers

SRV: rosapi_msgs/Subscribers
string topic
---
string[] subscribers

SRV: rosapi_msgs/Nodes
---
string[] nodes

SRV: rosapi_msgs/NodeDetails
string node
---
string[] subscribing
string[] publishing
string[] services

SRV: rosapi_msgs/Services
---
string[] services

SRV: rosapi_msgs/ServicesForType
string type
---
string[] services

SRV: rosapi_msgs/ServiceType
string service
---
string type

SRV: rosapi_msgs/ServiceNode
string service
---
string node

SRV: rosapi_msgs/ServiceHost
string service
---
string host

SRV: rosapi_msgs/ServiceProviders
string service
---
string[] providers

SRV: rosapi_msgs/MessageDetails
string type
---
TypeDef[] typedefs

SRV: rosapi_msgs/ServiceRequestDetails
string type
---
TypeDef[] typedefs

SRV: rosapi_msgs/ServiceResponseDetails
string type
---
TypeDef[] typedefs

SRV: rosapi_msgs/GetActionServers
---
string[] action_servers

SRV: rosapi_msgs/ActionType
string action
---
string type

SRV: rosapi_msgs/ActionGoalDetails
string type
---
TypeDef[] typedefs

SRV: rosapi_msgs/ActionResultDetails
string type
---
TypeDef[] typedefs

SRV: rosapi_msgs/ActionFeedbackDetails
string type
---
TypeDef[] typedefs

SRV: rosapi_msgs/Interfaces
---
string[] interfaces

SRV: rosapi_msgs/GetTime
---
builtin_interfaces/Time time

SRV: rosapi_msgs/GetROSVersion
---
uint8 version
string distro

SRV: rosapi_msgs/GetParamNames
---
string[] names

SRV: rosapi_msgs/GetParam
string name
string default_value
---
string value

SRV: rosapi_msgs/SetParam
string name
string value
---

SRV: rosapi_msgs/HasParam
string name
---
bool exists

SRV: rosapi_msgs/SearchParam
string name
---
string global_name

SRV: rosapi_msgs/DeleteParam
string name
---
"""
