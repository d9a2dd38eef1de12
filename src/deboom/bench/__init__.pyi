from .campaign_writer import write_campaign as write_campaign
from .component import ComponentPlan as ComponentPlan
from .component_writer import write_component_test as write_component_test
from .compressor_writer import write_compressor_test as write_compressor_test
from .compressor_writer import write_operating_test as write_operating_test
from .electric_car_writer import write_electric_car as write_electric_car
from .platform_writer import write_platform as write_platform
from .vehicle_writer import write_vehicle as write_vehicle
