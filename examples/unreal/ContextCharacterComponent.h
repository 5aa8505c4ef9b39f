// A character of a bundle of contextdb on an actor: it moves the actor and poses its mesh. Not compiled where contextdb is tested.
#pragma once

#include "CoreMinimal.h"
#include "Components/ActorComponent.h"
#include "ContextCrowd.h"

#include "ContextCharacterComponent.generated.h"

class UPoseableMeshComponent;

UCLASS(ClassGroup = (Animation), meta = (BlueprintSpawnableComponent))
class UContextCharacterComponent : public UActorComponent
{
    GENERATED_BODY()

public:
    UContextCharacterComponent();

    /** In the project's content, such as Motion/game.motion; the folder is among "Additional Non-Asset Directories To Package". */
    UPROPERTY(EditAnywhere, Category = "contextdb")
    FString Bundle = TEXT("Motion/game.motion");

    /** [controllers.NAME] of the project. */
    UPROPERTY(EditAnywhere, Category = "contextdb")
    FString Controller = TEXT("player");

    /** The velocity that the player asks for, cm/s over the ground. */
    UPROPERTY(BlueprintReadWrite, Category = "contextdb")
    FVector Stick = FVector::ZeroVector;

    /** What the game knows, for the tables: a text such as "Walk", or a number. It stays until it is set anew. */
    UFUNCTION(BlueprintCallable, Category = "contextdb")
    bool SetText(const FString& Fact, const FString& Value);

    UFUNCTION(BlueprintCallable, Category = "contextdb")
    bool SetNumber(const FString& Fact, double Value);

    /** What plays, what it did in the last update, and why. */
    UFUNCTION(BlueprintPure, Category = "contextdb")
    FString GetWhy() const;

    virtual void BeginPlay() override;
    virtual void TickComponent(float DeltaTime, ELevelTick TickType, FActorComponentTickFunction* ThisTickFunction) override;

private:
    contextdb::FCrowd Crowd;
    std::vector<contextdb::FJoint> Joints;
    TArray<FName> Bones;

    UPROPERTY()
    TObjectPtr<UPoseableMeshComponent> Mesh;
};
