"""stub"""
class TrainingRegion: pass
